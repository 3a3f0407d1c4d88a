#!/usr/bin/env bash
# Primary rays of a site's views at 512×512, 1 and 4 a pixel, on 2 threads: ours beside Embree's (pip install embreex),
# the same triangles and rays, in turns. Prints Mray/s (median over the turns) and the ratios to Embree.
set -euo pipefail
cd "$(dirname "$0")/../.."
turns=${1:-3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cargo build --release --quiet --example primary_rays
for _ in $(seq "$turns"); do
    "${CARGO_TARGET_DIR:-target}"/release/examples/primary_rays "$folder"
    python3 examples/primary_rays/embree.py "$folder"
done | tee /dev/stderr | awk '
    $4 == "Mray/s" { n[$1, $2]++; rate[$1, $2, n[$1, $2]] = $3 }
    function median(who, samples,   i, j, m, v, x) {
        m = n[who, samples]
        for (i = 1; i <= m; i++) v[i] = rate[who, samples, i]
        for (i = 2; i <= m; i++) { x = v[i]; for (j = i - 1; j > 0 && v[j] > x; j--) v[j + 1] = v[j]; v[j + 1] = x }
        return v[int((m + 1) / 2)]
    }
    END {
        for (samples = 1; samples <= 4; samples += 3) {
            e = median("embree", samples); p = median("packet", samples); s = median("single", samples)
            printf "%d a pixel: embree %.2f, packet %.2f (%.2f of embree), single %.2f (%.2f) Mray/s\n", samples, e, p, p / e, s, s / e
        }
    }'

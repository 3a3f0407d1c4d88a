"""Times Embree (pip install embreex) on the rays that main.rs wrote: embree.py FOLDER.

embreex keeps Python's lock while it casts, so two processes cast half the rays each. Both wait for each other before every
pass, and a pass lasts until the slower one has finished.
"""

import multiprocessing as mp
import sys
import time
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

PROCESSES = 2
REPEATS = 9


def worker(folder, samples, half, start, done, results):
    triangles = np.fromfile(folder / "triangles.f32", "<f4").reshape(-1, 3, 3)
    origins = np.fromfile(folder / "origins.f32", "<f4").reshape(-1, 3)
    directions = np.fromfile(folder / f"directions{samples}.f32", "<f4").reshape(-1, 3)
    origins = np.repeat(origins, len(directions) // len(origins), axis=0)
    # alternate runs of 64 tiles, so that both have the same work
    mine = np.arange(len(directions)) // 4096 % PROCESSES == half
    origins, directions = np.ascontiguousarray(origins[mine]), np.ascontiguousarray(directions[mine])
    scene = EmbreeScene()
    TriangleMesh(scene, triangles)
    scene.run(origins[:64], directions[:64])  # builds the tree
    for _ in range(REPEATS):
        start.wait()
        ids = scene.run(origins, directions)
        done.wait()
    results.put((len(directions), int((ids >= 0).sum())))


def measure(folder, samples):
    start, done, results = mp.Barrier(PROCESSES + 1), mp.Barrier(PROCESSES + 1), mp.Queue()
    workers = [mp.Process(target=worker, args=(folder, samples, i, start, done, results)) for i in range(PROCESSES)]
    for w in workers:
        w.start()
    seconds = []
    for _ in range(REPEATS):
        start.wait()
        begin = time.perf_counter()
        done.wait()
        seconds.append(time.perf_counter() - begin)
    counts = np.sum([results.get() for _ in workers], axis=0)
    for w in workers:
        w.join()
    rate = counts[0] / sorted(seconds)[REPEATS // 2] / 1e6
    print(f"embree {samples} {rate:.3f} Mray/s ({counts[1]} of {counts[0]} hit)")


if __name__ == "__main__":
    for samples in (1, 4):
        measure(Path(sys.argv[1]), samples)

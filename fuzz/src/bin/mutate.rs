//! Fuzzing on stable Rust: mutates seeds, and keeps what a reader answers in a new way.
//!
//! `cargo run --bin mutate -- [--seconds N] [--seed N] [READER…]`, in `fuzz/`. What panics or takes seconds is written
//! to `crashes/READER/`; if the program itself ends, what it read last is still in the folder that it names at the start.

use clerestory_fuzz::mutate::{Random, mend_checksums, mutated};
use clerestory_fuzz::{READERS, folder, read};
use std::collections::BTreeSet;
use std::error::Error;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What takes longer is a finding.
const SLOW: Duration = Duration::from_secs(5);

/// What one reader did.
#[derive(Default)]
struct Tally {
    executions: u64,
    accepted: u64,
    answers: BTreeSet<String>,
    findings: u64,
    slowest: Duration,
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut seconds, mut seed, mut readers) = (60.0, 1, Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--seconds" => seconds = value()?.parse::<f64>()?,
            "--seed" => seed = value()?.parse()?,
            name => readers.push(READERS.iter().copied().find(|r| *r == name).ok_or(format!("no reader “{name}”"))?),
        }
    }
    if readers.is_empty() {
        readers = READERS.to_vec();
    }
    clerestory::memory::set_limit(clerestory_fuzz::MEMORY);
    std::panic::set_hook(Box::new(|_| ())); // decoders' panics that the library catches are no news
    let each = Duration::from_secs_f64(seconds / readers.len() as f64);
    let mut findings = 0;
    println!(
        "{:8} {:>11} {:>10} {:>8} {:>9} {:>10}",
        "reader", "executions", "accepted", "answers", "findings", "slowest"
    );
    for reader in readers {
        let tally = fuzz(reader, each, seed)?;
        findings += tally.findings;
        let Tally { executions, accepted, answers, findings, slowest } = tally;
        println!(
            "{reader:8} {executions:>11} {accepted:>10} {:>8} {findings:>9} {:>7} ms",
            answers.len(),
            slowest.as_millis()
        );
    }
    if findings > 0 { Err(format!("{findings} findings in crashes/").into()) } else { Ok(()) }
}

fn fuzz(reader: &str, time: Duration, seed: u64) -> Result<Tally, Box<dyn Error>> {
    let home = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut inputs: Vec<Vec<u8>> = Vec::new();
    for kind in ["seeds", "corpus", "crashes"] {
        for path in files(&home.join(kind).join(reader)) {
            inputs.push(fs::read(path)?);
        }
    }
    if inputs.is_empty() {
        return Err(format!("there is no seed for {reader}: cargo run --bin seeds").into());
    }
    let folder = folder()?;
    eprintln!("{reader}: {} inputs; what is read lies in {}", inputs.len(), folder.path().display());
    let mut random = Random(seed);
    let mut tally = Tally::default();
    let start = Instant::now();
    let mut unchanged = inputs.clone().into_iter();
    let mut good: Vec<Vec<u8>> = Vec::new();
    while start.elapsed() < time {
        let fresh = unchanged.next();
        let is_new = fresh.is_none();
        let bytes = fresh.unwrap_or_else(|| {
            // what was read leads further in than what was refused
            let from = if random.below(4) > 0 && !good.is_empty() { &good } else { &inputs };
            let (one, other) = (random.below(from.len()), random.below(inputs.len()));
            let mut bytes = mutated(&from[one], &inputs[other], &mut random);
            if random.below(8) > 0 {
                mend_checksums(reader, &mut bytes);
            }
            bytes
        });
        let begun = Instant::now();
        let answer = catch_unwind(|| read(reader, &bytes, folder.path()));
        let took = begun.elapsed();
        tally.executions += 1;
        tally.slowest = tally.slowest.max(took);
        let finding = match &answer {
            Err(_) => Some("panic"),
            Ok(_) if took > SLOW => Some("slow"),
            Ok(_) => None,
        };
        if let Some(kind) = finding {
            tally.findings += 1;
            keep(&home.join("crashes").join(reader), kind, &bytes)?;
        }
        let Ok(answer) = answer else { continue };
        tally.accepted += u64::from(answer.is_ok());
        if answer.is_ok() && good.len() < 256 {
            good.push(bytes.clone());
        }
        let words = answer.err().map_or_else(|| format!("read, {} bytes", bytes.len().ilog2_or_zero()), |e| gist(&e));
        if tally.answers.insert(words) && is_new {
            keep(&home.join("corpus").join(reader), "new", &bytes)?;
            inputs.push(bytes);
        }
    }
    Ok(tally)
}

/// The next lower power of two, to tell lengths apart coarsely.
trait Log2 {
    fn ilog2_or_zero(self) -> u32;
}

impl Log2 for usize {
    fn ilog2_or_zero(self) -> u32 {
        self.checked_ilog2().unwrap_or(0)
    }
}

/// An error's words without what it quotes and counts.
fn gist(error: &str) -> String {
    let mut quoted = false;
    let unquoted = error.chars().filter(|c| {
        let shown = !quoted && *c != '“';
        quoted = if quoted { *c != '”' } else { *c == '“' };
        shown
    });
    let plain: String = unquoted.map(|c| if c.is_ascii_alphabetic() { c } else { ' ' }).collect();
    plain.split_whitespace().filter(|word| word.len() > 2).take(16).collect::<Vec<_>>().join(" ")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    files.sort();
    files
}

fn keep(folder: &Path, kind: &str, bytes: &[u8]) -> std::io::Result<()> {
    let mut hash = DefaultHasher::new();
    bytes.hash(&mut hash);
    fs::create_dir_all(folder)?;
    fs::write(folder.join(format!("{kind}-{:016x}", hash.finish())), bytes)
}

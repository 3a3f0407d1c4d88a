//! Fuzzing on stable Rust: mutates seeds and what a reader accepted, and keeps what it answers in a new way.
//!
//! `cargo run --release --bin mutate -- [--seconds N] [--seed N] [--accepted N] [--executions N] [--log FILE] [READER…]`, in `fuzz/`.
//! What panics or takes seconds is written to `crashes/READER/`; if the program itself ends, what it read last is still in the
//! folder that it names at the start.

use clerestory_fuzz::formats::changed;
use clerestory_fuzz::mutate::Random;
use clerestory_fuzz::{READERS, folder, read};
use std::collections::{BTreeSet, HashSet};
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;

type Done<T = ()> = Result<T, Box<dyn Error>>;

/// What takes longer is a finding: on the wall, and of the processor.
const SLOW: Duration = Duration::from_secs(5);

/// What takes longer ends the program.
const HANGS: Duration = Duration::from_secs(300);

/// How long one reader works before the next has its turn.
const TURN: Duration = Duration::from_secs(2);

/// How often a table goes to the log.
const LOGGED: Duration = Duration::from_secs(60);

/// Accepted inputs that are kept to begin from.
const KEPT: usize = 512;

/// Inputs to begin from that answers have led to.
const MOST_INPUTS: usize = 4096;

/// Accepted inputs that are told apart.
const COUNTED: usize = 1_000_000;

/// Longer inputs are cut.
const LONGEST: usize = 1 << 14;

struct Arguments {
    seconds: f64,
    seed: u64,
    /// Readers with fewer accepted inputs have their turn before the rest.
    accepted: u64,
    /// All readers together stop after as many.
    executions: u64,
    log: Option<PathBuf>,
    readers: Vec<&'static str>,
}

/// One reader and what it did.
struct Trial {
    reader: &'static str,
    folder: TempDir,
    random: Random,
    /// Inputs to read as they are, before any is changed.
    unread: Vec<Vec<u8>>,
    /// Seeds, and what was answered in a new way.
    inputs: Vec<Vec<u8>>,
    /// What was accepted last, in no order.
    good: Vec<Vec<u8>>,
    /// Hashes of accepted inputs, to count each once.
    accepted: HashSet<u64>,
    answers: BTreeSet<String>,
    executions: u64,
    findings: u64,
    slowest: Duration,
    busy: Duration,
}

fn arguments() -> Done<Arguments> {
    let mut all =
        Arguments { seconds: 60.0, seed: 1, accepted: 0, executions: u64::MAX, log: None, readers: Vec::new() };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--seconds" => all.seconds = value()?.parse()?,
            "--seed" => all.seed = value()?.parse()?,
            "--accepted" => all.accepted = value()?.parse()?,
            "--executions" => all.executions = value()?.parse()?,
            "--log" => all.log = Some(value()?.into()),
            name => {
                let known = READERS.iter().find(|r| **r == name);
                all.readers.push(known.ok_or_else(|| format!("no reader “{name}”"))?);
            }
        }
    }
    if all.readers.is_empty() {
        all.readers = READERS.to_vec();
    }
    Ok(all)
}

fn main() -> Done {
    let arguments = arguments()?;
    clerestory::memory::set_limit(clerestory_fuzz::MEMORY);
    std::panic::set_hook(Box::new(|_| ())); // decoders' panics that the library catches are no news
    // within a pool of one thread nothing waits for another
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).stack_size(8 << 20).build()?;
    pool.install(|| run(&arguments)).map_err(|e| e.to_string().into())
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut trials = Vec::new();
    for reader in &arguments.readers {
        trials.push(Trial::new(reader, arguments.seed).map_err(|e| e.to_string())?);
    }
    let start = Instant::now();
    let mut logged = start;
    watch();
    loop {
        let done: u64 = trials.iter().map(|t| t.executions).sum();
        if start.elapsed().as_secs_f64() > arguments.seconds || done >= arguments.executions {
            break;
        }
        let behind = |t: &Trial| (t.accepted.len() as u64) < arguments.accepted;
        let any_behind = trials.iter().any(behind);
        let quickest = trials.iter().map(Trial::rate).fold(0.0, f64::max);
        for trial in &mut trials {
            // then the quick ones fill up what is wanted in all
            let has_turn =
                if any_behind { behind(trial) } else { arguments.accepted == 0 || trial.rate() > quickest / 4.0 };
            if has_turn {
                trial.turn().map_err(|e| e.to_string())?;
            }
        }
        if let Some(log) = arguments.log.as_ref().filter(|_| logged.elapsed() > LOGGED) {
            logged = Instant::now();
            fs::write(log, table(&trials, start.elapsed()))?;
        }
    }
    let all = table(&trials, start.elapsed());
    if let Some(log) = &arguments.log {
        fs::write(log, &all)?;
    }
    print!("{all}");
    let findings: u64 = trials.iter().map(|t| t.findings).sum();
    if findings > 0 { Err(format!("{findings} findings in crashes/").into()) } else { Ok(()) }
}

fn table(trials: &[Trial], elapsed: Duration) -> String {
    let mut out = format!(
        "{:8} {:>11} {:>10} {:>8} {:>9} {:>10} {:>7}\n",
        "reader", "executions", "accepted", "answers", "findings", "slowest", "time"
    );
    let mut all = (0, 0, 0);
    for trial in trials {
        let (accepted, answers, slowest) = (trial.accepted.len(), trial.answers.len(), trial.slowest.as_millis());
        let Trial { reader, executions, findings, busy, .. } = trial;
        // writing to a string cannot fail
        let _ = writeln!(
            out,
            "{reader:8} {executions:>11} {accepted:>10} {answers:>8} {findings:>9} {slowest:>7} ms {:>5} s",
            busy.as_secs()
        );
        all = (all.0 + executions, all.1 + accepted, all.2 + findings);
    }
    let _ = writeln!(
        out,
        "{:8} {:>11} {:>10} {:>8} {:>9} {:>10} {:>5} s",
        "all",
        all.0,
        all.1,
        "",
        all.2,
        "",
        elapsed.as_secs()
    );
    out
}

/// Executions begun and ended: odd while one is under way.
static TURNS: AtomicU64 = AtomicU64::new(0);

/// How long this thread has had a processor, where the system tells (proc(5)).
fn on_processor() -> Option<Duration> {
    let text = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}

/// Ends the program when a reader hangs; what it read stays in its folder. Only time in which this program runs counts: it may be
/// stopped for a while.
fn watch() {
    /// How often it is looked before an execution hangs.
    const LOOKS: u32 = 10;
    std::thread::spawn(|| {
        let (mut last, mut looks) = (0, 0);
        loop {
            std::thread::sleep(HANGS / LOOKS);
            let turn = TURNS.load(Ordering::Relaxed);
            looks = if turn == last && turn % 2 == 1 { looks + 1 } else { 0 };
            last = turn;
            if looks >= LOOKS {
                eprintln!("a reader hangs");
                std::process::exit(3);
            }
        }
    });
}

impl Trial {
    fn new(reader: &'static str, seed: u64) -> Done<Trial> {
        let home = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut inputs: Vec<Vec<u8>> = Vec::new();
        for kind in ["seeds", "corpus", "crashes"] {
            for path in files(&home.join(kind).join(reader)) {
                inputs.push(fs::read(path)?);
            }
        }
        if inputs.is_empty() {
            return Err(format!("there is no seed for {reader}: cargo run --release --bin seeds").into());
        }
        let folder = folder()?;
        eprintln!("{reader}: {} inputs; what is read lies in {}", inputs.len(), folder.path().display());
        Ok(Trial {
            reader,
            folder,
            random: Random(seed),
            unread: inputs.clone(),
            inputs,
            good: Vec::new(),
            accepted: HashSet::new(),
            answers: BTreeSet::new(),
            executions: 0,
            findings: 0,
            slowest: Duration::ZERO,
            busy: Duration::ZERO,
        })
    }

    /// Executions a second.
    fn rate(&self) -> f64 {
        self.executions as f64 / self.busy.as_secs_f64().max(1e-3)
    }

    fn turn(&mut self) -> Done {
        let start = Instant::now();
        while start.elapsed() < TURN {
            match self.unread.pop() {
                Some(bytes) => self.execute(bytes, false)?,
                None => {
                    let bytes = self.next();
                    self.execute(bytes, true)?;
                }
            }
        }
        self.busy += start.elapsed();
        Ok(())
    }

    /// A new input: what was read leads further in than what was refused.
    fn next(&mut self) -> Vec<u8> {
        let from = if self.random.below(2) > 0 && !self.good.is_empty() { &self.good } else { &self.inputs };
        let (one, other) = (self.random.below(from.len()), self.random.below(self.inputs.len()));
        let mut bytes = changed(self.reader, &from[one], &self.inputs[other], &mut self.random);
        bytes.truncate(LONGEST);
        bytes
    }

    /// What the reader says, an error where it panics, and how long that took.
    fn timed(&self, bytes: &[u8]) -> (std::thread::Result<Result<String, String>>, Duration) {
        TURNS.fetch_add(1, Ordering::Relaxed);
        let begun = Instant::now();
        let answer = catch_unwind(|| read(self.reader, bytes, self.folder.path()));
        let took = begun.elapsed();
        TURNS.fetch_add(1, Ordering::Relaxed);
        (answer, took)
    }

    fn execute(&mut self, bytes: Vec<u8>, is_new: bool) -> Done {
        let (answer, mut took) = self.timed(&bytes);
        if took > SLOW {
            // on a machine with other work to do it may have waited: once more, by the processor's clock
            let begun = on_processor();
            let again = self.timed(&bytes).1;
            took = on_processor().zip(begun).map_or(again, |(end, begun)| end - begun);
        }
        self.executions += 1;
        self.slowest = self.slowest.max(took);
        let finding = match &answer {
            Err(_) => Some("panic"),
            Ok(_) if took > SLOW => Some("slow"),
            Ok(_) => None,
        };
        let home = Path::new(env!("CARGO_MANIFEST_DIR"));
        if let Some(kind) = finding {
            self.findings += 1;
            keep(&home.join("crashes").join(self.reader), kind, &bytes)?;
        }
        let Ok(answer) = answer else { return Ok(()) };
        if answer.is_ok() && self.accepted.len() < COUNTED && self.accepted.insert(hash(&bytes)) {
            if self.good.len() < KEPT {
                self.good.push(bytes.clone());
            } else {
                let place = self.random.below(KEPT);
                self.good[place].clone_from(&bytes);
            }
        }
        let words = match answer {
            Ok(said) => format!("read, 2^{} bytes, {}", bytes.len().checked_ilog2().unwrap_or(0), gist(&said)),
            Err(error) => gist(&error),
        };
        if self.answers.insert(words) && is_new && self.inputs.len() < MOST_INPUTS {
            keep(&home.join("corpus").join(self.reader), "new", &bytes)?;
            self.inputs.push(bytes);
        }
        Ok(())
    }
}

/// Words without what they quote and count.
fn gist(words: &str) -> String {
    let mut is_quoted = false;
    let mut plain = String::new();
    for c in words.chars() {
        is_quoted = match c {
            '“' => true,
            '”' => false,
            '"' | '`' => !is_quoted,
            _ => is_quoted,
        };
        plain.push(if !is_quoted && c.is_ascii_alphabetic() { c } else { ' ' });
    }
    plain.split_whitespace().filter(|word| word.len() > 2).take(16).collect::<Vec<_>>().join(" ")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    files.sort();
    files
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hash = DefaultHasher::new();
    bytes.hash(&mut hash);
    hash.finish()
}

fn keep(folder: &Path, kind: &str, bytes: &[u8]) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join(format!("{kind}-{:016x}", hash(bytes))), bytes)
}

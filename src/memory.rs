//! How much memory decoding one file may take: one limit for all readers of pictures and models, held against an estimate from the
//! file's head before anything is decoded.
//!
//! A few hundred bytes can stand for gigabytes of pixels, and Rust ends a program that runs out of memory. So each reader
//! says what it will need, and [`check`] refuses what is over the limit, or over what the system leaves this process
//! (`ulimit -v`).
//!
//! ```
//! use clerestory::memory;
//!
//! assert!(memory::check(1 << 20).is_ok());
//! assert!(memory::check(memory::limit() + 1).is_err());
//! ```

use std::sync::atomic::{AtomicU64, Ordering};

/// The limit unless another is set, in bytes: 2 GiB, a panorama of 16384 × 8192 pixels.
pub const DEFAULT_LIMIT: u64 = 2 << 30;

/// One for the process, as memory is.
static LIMIT: AtomicU64 = AtomicU64::new(DEFAULT_LIMIT);

/// Lets decoding one picture take so many bytes, from now on and on all threads.
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes, Ordering::Relaxed);
}

/// How many bytes decoding one picture may take.
pub fn limit() -> u64 {
    LIMIT.load(Ordering::Relaxed)
}

/// Decoding a file would take more memory than it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OverLimit {
    /// More than [`limit`].
    #[error(
        "decoding it takes about {}, and {} are allowed; scale it down, or allow more with --memory",
        readable(*needed),
        readable(*allowed)
    )]
    Allowed {
        /// Bytes that decoding takes.
        needed: u64,
        /// Bytes that it may take.
        allowed: u64,
    },
    /// More than the system leaves this process.
    #[error(
        "decoding it takes about {}, and the system leaves this process {} (ulimit -v); scale it down, or raise the limit",
        readable(*needed),
        readable(*left)
    )]
    Left {
        /// Bytes that decoding takes.
        needed: u64,
        /// Bytes that are left.
        left: u64,
    },
}

/// Whether so many bytes may be taken to decode one file.
///
/// # Errors
///
/// [`OverLimit`] where they may not.
pub fn check(needed: u64) -> Result<(), OverLimit> {
    let allowed = limit();
    if needed > allowed {
        return Err(OverLimit::Allowed { needed, allowed });
    }
    match left() {
        Some(left) if needed > left => Err(OverLimit::Left { needed, left }),
        _ => Ok(()),
    }
}

/// Address space that the system leaves this process, in bytes; `None` where it sets no limit or does not tell.
fn left() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    left_of(&limits, &status)
}

/// The same from the texts of `/proc/self/limits` and `/proc/self/status` (proc(5)).
fn left_of(limits: &str, status: &str) -> Option<u64> {
    let most = first_of(limits, "Max address space")?; // “unlimited” is no number
    Some(most.saturating_sub(first_of(status, "VmSize:")? << 10))
}

/// The first number of the line that begins with a key.
fn first_of(text: &str, key: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(key))?.split_whitespace().next()?.parse().ok()
}

/// The most memory that the process has held, in bytes, where the system tells.
pub fn peak() -> Option<u64> {
    Some(first_of(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")? << 10)
}

/// Bytes for people, in binary units.
fn readable(bytes: u64) -> String {
    let (unit, name) = if bytes >= 1 << 30 { (30, "GiB") } else { (20, "MiB") };
    format!("{:.1} {name}", bytes as f64 / f64::from(1u32 << unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_s_limit_less_what_is_taken_is_left() {
        let limits = "Limit  Soft Limit  Hard Limit  Units\nMax address space         2147483648           unlimited            bytes\n";
        let status = "Name:\tclerestory\nVmPeak:\t 9 kB\nVmSize:\t 1048576 kB\n";
        assert_eq!(left_of(limits, status), Some(1 << 30));
        assert_eq!(left_of(limits, "VmSize:\t 9048576 kB\n"), Some(0));
        assert_eq!(left_of("Max address space   unlimited   unlimited  bytes\n", status), None);
        assert_eq!(left_of("", status), None);
    }

    #[test]
    fn a_refusal_says_how_much_and_what_to_do() {
        let text = check(DEFAULT_LIMIT + (1 << 30)).unwrap_err().to_string();
        assert!(text.contains("3.0 GiB") && text.contains("2.0 GiB") && text.contains("--memory"), "{text}");
        assert_eq!(check(1 << 20), Ok(()));
    }
}

//! Wall time and the processor's own time.

use serde::{Deserialize, Serialize};
use std::time::Instant;

/// How long something took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// By the clock on the wall.
    pub wall_s: f64,
    /// Work of all threads together: what a shared machine leaves comparable. The wall's time where the system does not
    /// tell.
    pub cpu_s: f64,
}

impl Seconds {
    /// So many times as long.
    pub fn times(self, factor: f64) -> Self {
        Self { wall_s: self.wall_s * factor, cpu_s: self.cpu_s * factor }
    }
}

impl std::ops::Add for Seconds {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { wall_s: self.wall_s + other.wall_s, cpu_s: self.cpu_s + other.cpu_s }
    }
}

/// A stop watch.
#[derive(Debug)]
pub struct Clock {
    wall: Instant,
    cpu: Option<f64>,
}

impl Clock {
    /// Starts it.
    #[must_use]
    pub fn start() -> Self {
        Self { cpu: process_seconds(), wall: Instant::now() }
    }

    /// What has passed since the start.
    pub fn read(&self) -> Seconds {
        let wall_s = self.wall.elapsed().as_secs_f64();
        let cpu = self.cpu.zip(process_seconds()).map(|(from, to)| to - from);
        Seconds { wall_s, cpu_s: cpu.filter(|s| *s > 0.0).unwrap_or(wall_s) }
    }
}

/// Whether processor time can be told here.
pub fn has_processor_time() -> bool {
    process_seconds().is_some()
}

/// Processor seconds of the process's living threads: Linux counts them in nanoseconds in `/proc/self/task/*/schedstat`.
fn process_seconds() -> Option<f64> {
    let mut nanoseconds = 0u64;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat"));
        // a thread may end between the listing and the reading
        let spent = text.ok().and_then(|t| t.split_whitespace().next()?.parse::<u64>().ok());
        nanoseconds += spent.unwrap_or(0);
    }
    (nanoseconds > 0).then_some(nanoseconds as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_time_and_sleep_takes_no_work() {
        let clock = Clock::start();
        std::thread::sleep(std::time::Duration::from_millis(60));
        let slept = clock.read();
        assert!(slept.wall_s >= 0.06);
        if has_processor_time() {
            let clock = Clock::start();
            let mut x = 1.0f64;
            while clock.read().cpu_s < 0.01 {
                x = std::hint::black_box(x.sin() + 1.0);
            }
            // other threads of the process work, too: how long it took says nothing
            assert!(clock.read().wall_s > 0.0, "{x}");
        }
        let sum = slept.times(2.0) + slept;
        assert!((sum.wall_s - 3.0 * slept.wall_s).abs() < 1e-12);
    }
}

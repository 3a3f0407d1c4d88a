//! Progress of long work: on a terminal only, on stderr.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal};
use std::time::Duration;

use super::output::Told;
use super::visible::visible;

impl Told {
    /// A bar drawn after indicatif's `template`; hidden where nobody is told or stderr is no terminal.
    pub(crate) fn bar(self, template: &str) -> ProgressBar {
        if !self.talks() || !io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(1).with_style(style);
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }

    /// Does work under a bar of steps; the work tells what it is doing, and how many steps are done of how many.
    pub(crate) fn by_steps<T>(self, work: impl FnOnce(&(dyn Fn(&str, usize, usize) + Sync)) -> T) -> T {
        let bar = self.bar("{msg:16} {wide_bar} {pos} of {len}  {eta} left");
        let done = work(&|doing, done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
            bar.set_message(visible(doing).into_owned());
        });
        bar.finish_and_clear();
        done
    }
}

//! How far a run is, told on standard error. Does not know what the tasks do.

use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

/// How progress is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ProgressMode {
    /// Bars with the time left on a terminal, plain lines elsewhere.
    #[default]
    Auto,
    /// Nothing (`--quiet`).
    Quiet,
    /// One JSON object a line (`--json-progress`): `{"task", "done", "total", "elapsed_s", "eta_s"}` or `{"note"}`.
    Json,
}

/// Tells how far tasks are; clones tell to the same place.
#[derive(Clone)]
pub struct Progress(Telling);

#[derive(Clone)]
enum Telling {
    Nothing,
    Bars(MultiProgress),
    Lines { to: Output, json: bool, every: Duration },
}

type Output = Arc<Mutex<dyn Write + Send>>;

/// A plain line at most this often.
const LINES_EVERY: Duration = Duration::from_secs(3);
const JSON_EVERY: Duration = Duration::from_millis(500);

impl Progress {
    /// Tells on standard error.
    pub fn new(mode: ProgressMode) -> Self {
        let to: Output = Arc::new(Mutex::new(io::stderr()));
        let dumb = std::env::var_os("TERM").is_some_and(|t| t == "dumb");
        Self(match mode {
            ProgressMode::Quiet => Telling::Nothing,
            ProgressMode::Json => Telling::Lines { to, json: true, every: JSON_EVERY },
            ProgressMode::Auto if io::stderr().is_terminal() && !dumb => {
                Telling::Bars(MultiProgress::with_draw_target(ProgressDrawTarget::stderr()))
            }
            ProgressMode::Auto => Telling::Lines { to, json: false, every: LINES_EVERY },
        })
    }

    /// Begins a task of `total` steps.
    pub fn task(&self, name: &str, total: u64) -> Task {
        let bar = match &self.0 {
            Telling::Bars(bars) => {
                Some(bars.add(ProgressBar::new(total).with_style(style()).with_prefix(name.to_owned())))
            }
            _ => None,
        };
        let now = Instant::now();
        let mut task =
            Task { name: name.to_owned(), done: 0, total, begun: now, told: None, bar, telling: self.0.clone() };
        task.tell(now, true);
        task
    }

    /// Says one line that stays.
    pub fn note(&self, text: &str) {
        match &self.0 {
            Telling::Nothing => {}
            Telling::Bars(bars) => bars.suspend(|| write_line(&mut io::stderr(), text)),
            Telling::Lines { to, json: true, .. } => say(to, &json!({ "note": text }).to_string()),
            Telling::Lines { to, .. } => say(to, text),
        }
    }
}

/// A task under way. Dropped, it takes its bar away.
pub struct Task {
    name: String,
    done: u64,
    total: u64,
    begun: Instant,
    /// When a line was last written.
    told: Option<Instant>,
    bar: Option<ProgressBar>,
    telling: Telling,
}

impl Task {
    /// Adds steps done.
    pub fn advance(&mut self, steps: u64) {
        self.set(self.done.saturating_add(steps));
    }

    /// Says how many steps are done; more than all are counted as all.
    pub fn set(&mut self, done: u64) {
        let done = done.min(self.total);
        if done != self.done {
            self.done = done;
            self.tell(Instant::now(), false);
        }
    }

    /// Ends the task as done.
    pub fn finish(mut self) {
        let already_told = self.done == self.total;
        self.done = self.total;
        if !already_told {
            self.tell(Instant::now(), true);
        }
    }

    fn tell(&mut self, now: Instant, must: bool) {
        if let Some(bar) = &self.bar {
            bar.set_position(self.done);
        }
        let Telling::Lines { to, json, every } = &self.telling else { return };
        let last = self.done == self.total;
        if !must && !last && self.told.is_some_and(|t| now.duration_since(t) < *every) {
            return;
        }
        self.told = Some(now);
        let elapsed = now.duration_since(self.begun).as_secs_f64();
        // At the rate so far; unknown before the first step.
        let left = (self.done > 0).then(|| elapsed / self.done as f64 * (self.total - self.done) as f64);
        say(to, &if *json { self.json(elapsed, left) } else { self.line(elapsed, left) });
    }

    fn json(&self, elapsed: f64, left: Option<f64>) -> String {
        let round = |s: f64| (s * 1000.0).round() / 1000.0;
        json!({
            "task": self.name, "done": self.done, "total": self.total,
            "elapsed_s": round(elapsed), "eta_s": left.map(round),
        })
        .to_string()
    }

    fn line(&self, elapsed: f64, left: Option<f64>) -> String {
        let Self { name, done, total, .. } = self;
        match left {
            Some(_) if done == total => format!("{name}: {done}/{total}, done in {elapsed:.1} s"),
            Some(left) => format!("{name}: {done}/{total}, {elapsed:.0} s, about {left:.0} s left"),
            None => format!("{name}: {done}/{total}"),
        }
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn style() -> ProgressStyle {
    // The library leaves colours out itself where NO_COLOR is set.
    let template = "{prefix:>12} {bar:40.cyan/blue} {pos}/{len} {elapsed} (about {eta} left)";
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn say(to: &Output, line: &str) {
    // A writer that panicked midway holds nothing worth protecting.
    let mut to = to.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    write_line(&mut *to, line);
}

fn write_line(to: &mut dyn Write, line: &str) {
    // Nothing is to be done about a closed standard error, and a run does not stop for it.
    let _ = writeln!(to, "{line}").and_then(|()| to.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(json: bool, every: Duration, run: impl FnOnce(&Progress)) -> Vec<String> {
        let bytes = Arc::new(Mutex::new(Vec::<u8>::new()));
        run(&Progress(Telling::Lines { to: bytes.clone(), json, every }));
        let text = String::from_utf8(bytes.lock().unwrap().clone()).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn lines_are_few() {
        let lines = told(false, Duration::from_secs(3600), |p| {
            let mut task = p.task("simulate", 1000);
            (0..1000).for_each(|_| task.advance(1));
            task.finish();
        });
        assert_eq!(lines.len(), 2, "one at the beginning and one at the end: {lines:?}");
        assert_eq!(lines[0], "simulate: 0/1000");
        assert!(lines[1].starts_with("simulate: 1000/1000, done in "), "{}", lines[1]);
    }

    #[test]
    fn lines_have_the_time_left_and_no_escapes() {
        let lines = told(false, Duration::ZERO, |p| {
            let mut task = p.task("encode", 4);
            task.set(1);
            p.note("a note");
            task.set(9);
        });
        assert!(lines[1].starts_with("encode: 1/4, ") && lines[1].ends_with(" s left"), "{}", lines[1]);
        assert_eq!(lines[2], "a note");
        assert!(lines[3].starts_with("encode: 4/4, done"), "{}", lines[3]);
        assert!(!lines.concat().contains('\u{1b}'));
    }

    #[test]
    fn json_lines_are_objects() {
        let lines = told(true, Duration::ZERO, |p| {
            let mut task = p.task("simulate", 2);
            p.note("quote \" and\nnew line");
            task.advance(1);
            task.finish();
        });
        let values: Vec<serde_json::Value> = lines.iter().map(|l| serde_json::from_str(l).unwrap()).collect();
        assert_eq!(values.len(), 4);
        assert_eq!(values[0]["done"], 0);
        assert!(values[0]["eta_s"].is_null());
        assert_eq!(values[1]["note"], "quote \" and\nnew line");
        assert!(values[2]["eta_s"].is_number());
        assert_eq!((&values[3]["task"], &values[3]["done"]), (&json!("simulate"), &json!(2)));
        assert_eq!(values[3]["eta_s"], 0.0);
    }

    #[test]
    fn an_empty_task_ends_without_dividing_by_nothing() {
        let lines = told(false, Duration::ZERO, |p| p.task("fill", 0).finish());
        assert_eq!(lines, ["fill: 0/0"]);
    }

    #[test]
    fn quiet_says_nothing_and_bars_do_not_fail_without_a_terminal() {
        let mut task = Progress::new(ProgressMode::Quiet).task("simulate", 3);
        task.advance(3);
        task.finish();
        let hidden = Progress(Telling::Bars(MultiProgress::with_draw_target(ProgressDrawTarget::hidden())));
        let mut task = hidden.task("simulate", 3);
        task.advance(2);
        assert_eq!(task.bar.as_ref().map(ProgressBar::position), Some(2));
        hidden.note("");
        task.finish();
    }
}

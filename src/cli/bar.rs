//! A progress bar: what it says, and how it gets to standard error.

use std::{
    env, fmt,
    io::{self, Write},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{RecvTimeoutError, Sender, channel},
    },
    thread,
    time::{Duration, Instant},
};

use console::truncate_str;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use super::printable;
use crate::programs::TETHER;

/// Columns of a line at most: a terminal as it opens.
pub(super) const WIDTH: usize = 80;

/// Columns of the bar itself.
const BAR: usize = 12;

/// Seconds after which what was counts for a third in the rate: long enough for a pause not to
/// shake the time that is left, short enough to follow a training whose Gaussians grow.
const MEMORY: f64 = 15.0;

/// Redraw interval where no progress is reported.
const TICK: Duration = Duration::from_millis(250);

/// Interval of lines where standard error is no terminal, and where a page shows them.
const LINE: Duration = Duration::from_secs(60);
const LINE_OF_PAGE: Duration = Duration::from_secs(1);

/// Progress line on standard error; where that is no terminal, a line a minute.
pub(super) struct Bar {
    shown: ProgressBar,
    state: Arc<Mutex<BarText>>,
    /// Ends the lines when it is dropped.
    _lines: Option<Sender<()>>,
}

impl Bar {
    /// A bar for something that begins; `place` is which of how many it is.
    pub fn begin(name: &str, place: Option<[usize; 2]>) -> Self {
        let state = Arc::new(Mutex::new(BarText::new(name, place, Instant::now())));
        let said = state.clone();
        let line = move |_: &ProgressState, out: &mut dyn fmt::Write| {
            // Writing to a string cannot fail.
            let _ = out.write_str(&locked(&said).line(Instant::now()));
        };
        let style = ProgressStyle::with_template("{line}")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .with_key("line", line);
        let shown = ProgressBar::new_spinner().with_style(style);
        shown.enable_steady_tick(TICK);
        let say = |line: String| {
            // Nobody may listen any more.
            let _ = writeln!(io::stderr(), "{line}");
        };
        let interval = match env::var_os(TETHER) {
            Some(_) => LINE_OF_PAGE,
            None => LINE,
        };
        let lines = (shown.is_hidden()).then(|| in_lines(state.clone(), interval, say));
        Self {
            shown,
            state,
            _lines: lines,
        }
    }

    /// So many steps of so many are done; of 0 where they are not counted.
    pub fn update(&self, done: usize, total: usize, message: &str) {
        locked(&self.state).update(done, total, printable::line(message), Instant::now());
        self.shown.tick();
    }

    /// Prints lines above it.
    pub fn print(&self, lines: &str) {
        if self.shown.is_hidden() {
            eprintln!("{lines}");
        } else {
            self.shown.println(lines);
        }
    }

    /// Leaves it at its end, with its last message where that is worth `keeping`.
    pub fn end(self, keeping: bool) {
        // Dropped, it is drawn for the last time.
        let mut state = locked(&self.state);
        state.ended = Some(Instant::now());
        if !keeping {
            state.message.clear();
        }
    }
}

impl Drop for Bar {
    /// Leaves it on the screen; what is not ended as far as it came.
    fn drop(&mut self) {
        self.shown.abandon();
    }
}

/// Says after every `interval` how far something has come, until the sender is dropped.
fn in_lines(
    state: Arc<Mutex<BarText>>,
    interval: Duration,
    say: impl Fn(String) + Send + 'static,
) -> Sender<()> {
    let (sender, ended) = channel();
    thread::spawn(move || {
        while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(interval) {
            say(locked(&state).plain(Instant::now()));
        }
    });
    sender
}

/// Whoever panicked while drawing leaves a state that can be drawn.
fn locked(state: &Mutex<BarText>) -> MutexGuard<'_, BarText> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Text of a progress bar.
struct BarText {
    name: String,
    place: String,
    begun: Instant,
    ended: Option<Instant>,
    done: usize,
    total: usize,
    message: String,
    /// When something was done last.
    last: Instant,
    /// Steps of late and the seconds they took, older ones fading.
    pace: [f64; 2],
}

impl BarText {
    fn new(name: &str, place: Option<[usize; 2]>, now: Instant) -> Self {
        Self {
            name: name.to_owned(),
            place: place.map_or(String::new(), |[which, of]| format!("{which} of {of}")),
            begun: now,
            ended: None,
            done: 0,
            total: 0,
            message: String::new(),
            last: now,
            pace: [0.0; 2],
        }
    }

    fn update(&mut self, done: usize, total: usize, message: String, now: Instant) {
        if done < self.done || self.total == 0 {
            // It begins, or begins again.
            (self.last, self.pace) = (now, [0.0; 2]);
        } else if done > self.done {
            let seconds = (now - self.last).as_secs_f64();
            let kept = (-seconds / MEMORY).exp();
            let [steps, before] = self.pace;
            self.pace = [
                steps * kept + (done - self.done) as f64,
                before * kept + seconds,
            ];
            self.last = now;
        }
        (self.done, self.total, self.message) = (done, total, message);
    }

    /// Seconds that a step takes, once there were some.
    fn seconds_each(&self) -> Option<f64> {
        let [steps, seconds] = self.pace;
        (steps > 0.0 && seconds > 0.0).then(|| seconds / steps)
    }

    /// The line without a bar.
    fn plain(&self, now: Instant) -> String {
        let elapsed = duration((now - self.begun).as_secs_f64());
        let counts = match self.total {
            0 => String::new(),
            total => format!(" {}/{total}", self.done),
        };
        let message = match self.message.is_empty() {
            true => String::new(),
            false => format!(", {}", self.message),
        };
        let line = format!("{}{counts} after {elapsed}{message}", self.name);
        truncate_str(&line, WIDTH, "…").into_owned()
    }

    /// The line as it is now.
    fn line(&self, now: Instant) -> String {
        let mut line = format!("{:<9} {:>8} ", self.name, self.place);
        let share = match self.ended {
            Some(_) => 1.0,
            None => self.done.min(self.total) as f64 / self.total.max(1) as f64,
        };
        let full = (share * BAR as f64) as usize;
        line.extend((0..BAR).map(|k| if k < full { '█' } else { '░' }));
        let elapsed = (self.ended.unwrap_or(now) - self.begun).as_secs_f64();
        let (each, counts) = (self.seconds_each(), self.ended.is_none() && self.total > 0);
        line += &match (counts, each) {
            (false, _) if self.ended.is_some() => format!(" {elapsed:.1} s"),
            (false, _) => format!(" {}", duration(elapsed)),
            (true, None) => format!(" {}/{} {}", self.done, self.total, duration(elapsed)),
            (true, Some(each)) => {
                let left = self.total.saturating_sub(self.done) as f64 * each;
                let waited = (now - self.last).as_secs_f64();
                let left = duration((left - waited).max(0.0));
                format!(" {}/{} {} ETA {left}", self.done, self.total, rate(each))
            }
        };
        if !self.message.is_empty() {
            line += &format!(" {}", self.message);
        }
        truncate_str(&line, WIDTH, "…").into_owned()
    }
}

/// Steps per second, or seconds per step where a step takes longer than one.
fn rate(each: f64) -> String {
    match each <= 1.0 {
        true => format!("{:.1}/s", 1.0 / each),
        false => format!("{each:.1} s/it"),
    }
}

/// Seconds in few digits: `26 s`, `4:05`, `1:02:03`.
fn duration(seconds: f64) -> String {
    let whole = seconds as u64;
    let [hours, minutes, seconds] = [whole / 3600, whole / 60 % 60, whole % 60];
    match (hours, minutes) {
        (0, 0) => format!("{seconds} s"),
        (0, _) => format!("{minutes}:{seconds:02}"),
        _ => format!("{hours}:{minutes:02}:{seconds:02}"),
    }
}

#[cfg(test)]
mod tests {
    use console::measure_text_width;

    use super::*;

    /// A bar that began a while ago, and what it says so many seconds after its beginning.
    struct Excerpt {
        state: BarText,
        begun: Instant,
    }

    impl Excerpt {
        fn new(name: &str, place: Option<[usize; 2]>) -> Self {
            let begun = Instant::now();
            Self {
                state: BarText::new(name, place, begun),
                begun,
            }
        }

        fn update(&mut self, seconds: f64, done: usize, total: usize, message: &str) {
            let now = self.begun + Duration::from_secs_f64(seconds);
            self.state.update(done, total, message.to_owned(), now);
        }

        fn at(&self, seconds: f64) -> String {
            self.state
                .line(self.begun + Duration::from_secs_f64(seconds))
        }
    }

    #[test]
    fn without_a_terminal_there_are_lines_until_it_ends() {
        let begun = Instant::now();
        let mut text = BarText::new("mapping", None, begun);
        let later = begun + Duration::from_secs(65);
        assert_eq!(text.plain(later), "mapping after 1:05");
        text.update(3, 30, "0003.png".to_owned(), later);
        assert_eq!(text.plain(later), "mapping 3/30 after 1:05, 0003.png");
        let (said, lines) = channel();
        let state = Arc::new(Mutex::new(text));
        let ends = in_lines(state, Duration::from_millis(5), move |line| {
            let _ = said.send(line);
        });
        let patience = Duration::from_secs(20);
        for _ in 0..2 {
            let line = lines.recv_timeout(patience).expect("a line");
            assert!(line.starts_with("mapping 3/30 after "), "{line}");
        }
        drop(ends);
        while lines.recv_timeout(patience).is_ok() {}
        // Its end is heard.
        assert!(lines.recv().is_err());
    }

    #[test]
    fn a_bar_says_where_it_is_and_how_fast() {
        let mut story = Excerpt::new("training", Some([5, 8]));
        assert_eq!(story.at(2.0), "training    5 of 8 ░░░░░░░░░░░░ 2 s");
        story.update(2.0, 0, 700, "");
        assert_eq!(story.at(3.5), "training    5 of 8 ░░░░░░░░░░░░ 0/700 3 s");
        story.update(12.0, 250, 700, "24.31 dB");
        assert_eq!(
            story.at(12.0),
            "training    5 of 8 ████░░░░░░░░ 250/700 25.0/s ETA 18 s 24.31 dB"
        );
        // The rate does not sink while nothing is heard, and the time that is left passes.
        assert_eq!(
            story.at(17.0),
            "training    5 of 8 ████░░░░░░░░ 250/700 25.0/s ETA 13 s 24.31 dB"
        );
        story.state.ended = Some(story.begun + Duration::from_secs(31));
        assert_eq!(
            story.at(99.0),
            "training    5 of 8 ████████████ 31.0 s 24.31 dB"
        );
    }

    #[test]
    fn what_is_slow_is_told_in_seconds() {
        let mut story = Excerpt::new("solving", None);
        story.update(0.0, 0, 12, "");
        story.update(73.0, 1, 12, "loss 3.412");
        assert_eq!(
            story.at(73.0),
            "solving            █░░░░░░░░░░░ 1/12 73.0 s/it ETA 13:23 loss 3.412"
        );
        assert!(story.at(5000.0).contains("73.0 s/it ETA 0 s"));
    }

    #[test]
    fn the_time_left_does_not_jump() {
        let mut story = Excerpt::new("training", None);
        story.update(0.0, 0, 1000, "");
        let (mut now, mut before) = (0.0, 0.0);
        // Every tenth report is late.
        for step in 1..=90 {
            now += if step % 10 == 0 { 3.0 } else { 1.0 };
            story.update(now, 10 * step, 1000, "");
            let [steps, seconds] = story.state.pace;
            let left = (1000 - 10 * step) as f64 * seconds / steps;
            if step > 10 {
                assert!(
                    (left - before).abs() < 0.25 * before + 3.0,
                    "{before} {left}"
                );
            }
            before = left;
        }
    }

    #[test]
    fn a_second_round_begins_anew() {
        let mut story = Excerpt::new("photos", None);
        story.update(0.0, 0, 30, "");
        story.update(30.0, 30, 30, "");
        story.update(31.0, 1, 30, "");
        assert_eq!(story.at(31.0), "photos             ░░░░░░░░░░░░ 1/30 31 s");
        story.update(31.5, 2, 30, "");
        assert!(
            story.at(31.5).contains("2.0/s ETA 14 s"),
            "{}",
            story.at(31.5)
        );
    }

    #[test]
    fn no_line_is_longer_than_a_terminal() {
        for name in [
            "DSC_0042 of the very long walk around the old town hall.jpg",
            &"日本".repeat(40),
        ] {
            let mut story = Excerpt::new("measuring", Some([10, 12]));
            story.update(0.0, 10_000, 123_456, name);
            story.update(9.0, 20_000, 123_456, name);
            for line in [story.at(9.0), story.at(10_000.0)] {
                assert!(measure_text_width(&line) <= WIDTH, "{line}");
                assert!(line.ends_with('…'), "{line}");
            }
        }
    }
}

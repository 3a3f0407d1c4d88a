//! What a study says: who is quicker at the same error, who is nearer in the same time, and how error falls.

use crate::study::conclusions::result::{Convergence, EqualTime, Row, SpeedUp, Summary, Whole};

use super::verdict::{losses, recommended};
use crate::study::clock::Seconds;
use crate::study::curve::{Curve, order, pareto};
use crate::study::measure::Run;
use crate::study::metrics::blocks::{Block, Interval, Metric, Resamples};
use crate::study::outside::Outside;
use crate::study::state::Study;
use crate::study::sweep::{Method, Parameter};

/// Bootstrap draws.
const DRAWS: usize = 500;

/// Error as something that is better the less it is.
pub(crate) fn error(metric: Metric, blocks: &[Block], weights: &[f32]) -> f64 {
    let value = metric.over(blocks, weights);
    if metric == Metric::Ssim { 1.0 - value } else { value }
}

/// What a study says; `outside` are other programs' curves, `render` the command that renders the site with the settings as they come.
pub fn summary(study: &Study, outside: &[Outside], render: &str) -> Summary {
    let resamples = Resamples::new(&study.blocks, DRAWS);
    let mut whole: Vec<Whole> = study
        .runs
        .iter()
        .filter(|r| r.views.len() == study.blocks.len())
        .map(|run| Whole { run, blocks: run.blocks() })
        .collect();
    let place = |w: &Whole| (w.run.setting.method, w.run.setting.parameter);
    whole.sort_by(|a, b| place(a).cmp(&place(b)).then(a.run.setting.value.total_cmp(&b.run.setting.value)));
    let rows = rows(&whole, &resamples);
    let (mut speed_ups, mut equal_time) = (Vec::new(), Vec::new());
    if let Some(ours) = whole.iter().find(|w| w.run.is_plain_ibs()) {
        let widest = ours.run.widest();
        let of_whole = Resamples::new(&widest.iter().map(|v| v.len()).collect::<Vec<_>>(), DRAWS);
        for metric in Metric::ALL {
            let traced = Rival::tracer(&whole, metric);
            let outside = outside.iter().filter_map(|o| Rival::outside(o, metric));
            let tiles = Ours { run: ours.run, blocks: ours.blocks.clone(), resamples: &resamples };
            // other programs were measured over whole pictures
            let whole = Ours {
                run: ours.run,
                blocks: widest.iter().flat_map(|v| v.iter().copied()).collect(),
                resamples: &of_whole,
            };
            let pairs = traced.into_iter().map(|t| (t, &tiles)).chain(outside.map(|o| (o, &whole)));
            for (rival, ours) in pairs {
                // a ratio to an error or a time of 0 says nothing
                speed_ups.extend(rival.speed_up(ours).filter(|s| finite(&s.frame) && finite(&s.with_setup)));
                let equal = [false, true].into_iter().filter_map(|s| rival.equal_time(ours, s));
                equal_time.extend(equal.filter(|e| finite(&e.ratio)));
            }
        }
    }
    let recommended = recommended(&rows, render, &study.order);
    let losses = losses(&whole, &rows, &speed_ups);
    let convergence = convergence(study, &whole, &resamples);
    let probe_order = study.order.clone();
    Summary { rows, speed_ups, equal_time, convergence, recommended, probe_order, losses }
}

fn finite(i: &Interval) -> bool {
    [i.value, i.low, i.high].iter().all(|v| v.is_finite())
}

fn rows(whole: &[Whole], resamples: &Resamples) -> Vec<Row> {
    let flip = |w: &Whole| Metric::Flip.over(&w.blocks, &vec![1.0; w.blocks.len()]);
    let front = pareto(&whole.iter().map(|w| (w.run.frame().cpu_s, flip(w))).collect::<Vec<_>>());
    let row = |(w, pareto): (&Whole, bool)| {
        let [rmse, relmse, flip, ssim] = Metric::ALL.map(|m| resamples.interval(|draw| m.over(&w.blocks, draw)));
        let (setting, setup, frame) = (w.run.setting, w.run.setup, w.run.frame());
        Row { setting, label: setting.label(), setup, frame, rmse, relmse, flip, ssim, pareto }
    };
    whole.iter().zip(front).map(row).collect()
}

/// Image-based shooting as it comes, over the pixels that a rival was measured over.
struct Ours<'a> {
    run: &'a Run,
    blocks: Vec<Block>,
    resamples: &'a Resamples,
}

/// Another way to make pictures: its error by time, as it would be for another draw of blocks.
struct Rival<'a> {
    name: String,
    metric: Metric,
    /// Processor and wall seconds of each point, and its error.
    points: Vec<(Seconds, PointError<'a>)>,
    setup_s: f64,
}

enum PointError<'a> {
    Blocks(&'a [Block]),
    Known(f64),
}

impl<'a> Rival<'a> {
    fn tracer(whole: &'a [Whole], metric: Metric) -> Option<Self> {
        let mine: Vec<&Whole> = whole.iter().filter(|w| w.run.setting.method == Method::PathTracing).collect();
        let setup_s = mine.first()?.run.setup.cpu_s;
        let points = mine.iter().map(|w| (w.run.frame(), PointError::Blocks(&w.blocks))).collect();
        Some(Self { name: Method::PathTracing.name().to_owned(), metric, points, setup_s })
    }

    fn outside(outside: &Outside, metric: Metric) -> Option<Self> {
        let point = |p: &crate::study::OutsidePoint| {
            Some((Seconds { wall_s: p.wall_s, cpu_s: p.cpu_s }, PointError::Known(p.error(metric)?)))
        };
        let points = outside.points.iter().map(point).collect::<Option<Vec<_>>>()?;
        Some(Self { name: outside.name.clone(), metric, points, setup_s: 0.0 })
    }

    fn curve(&self, draw: &[f32], time: fn(&Seconds) -> f64) -> Curve {
        let error = |e: &PointError| match e {
            PointError::Blocks(blocks) => error(self.metric, blocks, draw),
            PointError::Known(error) => *error,
        };
        Curve::new(self.points.iter().map(|(t, e)| (time(t), error(e))))
    }

    fn speed_up(&self, ours: &Ours) -> Option<SpeedUp> {
        let once = vec![1.0; ours.blocks.len()];
        let (frame, setup) = (ours.run.frame(), ours.run.setup);
        let reach = |draw: &[f32], time| self.curve(draw, time).time_at(error(self.metric, &ours.blocks, draw));
        let cpu = |draw: &[f32]| reach(draw, |s| s.cpu_s).map_or(f64::NAN, |t| t.0);
        let (needed_cpu_s, how) = reach(&once, |s| s.cpu_s)?;
        Some(SpeedUp {
            against: self.name.clone(),
            metric: self.metric,
            error: error(self.metric, &ours.blocks, &once),
            needed_cpu_s,
            how,
            frame: ours.resamples.interval(|draw| cpu(draw) / frame.cpu_s),
            frame_wall: reach(&once, |s| s.wall_s).map(|t| t.0 / frame.wall_s),
            with_setup: ours.resamples.interval(|draw| (cpu(draw) + self.setup_s) / (frame.cpu_s + setup.cpu_s)),
        })
    }

    fn equal_time(&self, ours: &Ours, with_setup: bool) -> Option<EqualTime> {
        let once = vec![1.0; ours.blocks.len()];
        let (frame, setup) = (ours.run.frame().cpu_s, ours.run.setup.cpu_s);
        let cpu_s = if with_setup { frame + setup } else { frame };
        let left = if with_setup { (cpu_s - self.setup_s).max(0.0) } else { cpu_s };
        let theirs = |draw: &[f32]| self.curve(draw, |s| s.cpu_s).error_at(left);
        let ratio = |draw: &[f32]| theirs(draw).map_or(f64::NAN, |e| e.0 / error(self.metric, &ours.blocks, draw));
        let (error, how) = theirs(&once)?;
        let ratio = ours.resamples.interval(ratio);
        Some(EqualTime { against: self.name.clone(), metric: self.metric, with_setup, cpu_s, error, how, ratio })
    }
}

fn convergence(study: &Study, whole: &[Whole], resamples: &Resamples) -> Vec<Convergence> {
    let mut all = Vec::new();
    let pairs: std::collections::BTreeSet<_> =
        whole.iter().map(|w| (w.run.setting.method, w.run.setting.parameter)).collect();
    for (method, parameter) in pairs {
        if parameter == Parameter::AsItComes {
            continue;
        }
        let of = |w: &&Whole| {
            let setting = w.run.setting;
            setting.method == method && (setting.parameter == parameter || setting.parameter == Parameter::AsItComes)
        };
        let value = |w: &Whole| match w.run.setting.parameter {
            Parameter::AsItComes => study.base.value(parameter),
            _ => w.run.setting.value,
        };
        let mut mine: Vec<(f64, &Whole)> = whole.iter().filter(of).map(|w| (value(w), w)).collect();
        mine.sort_by(|a, b| a.0.total_cmp(&b.0));
        if mine.len() < 2 {
            continue;
        }
        for metric in [Metric::Rmse, Metric::Flip] {
            let points = |draw: &[f32]| -> Vec<(f64, f64)> {
                mine.iter().map(|(v, w)| (*v, error(metric, &w.blocks, draw))).collect()
            };
            let order = resamples.interval(|draw| order(&points(draw)).unwrap_or(f64::NAN));
            let once = vec![1.0; study.blocks.iter().sum()];
            let tail = tail(&points(&once));
            // an error of 0 has no logarithm
            if !order.value.is_finite() {
                continue;
            }
            all.push(Convergence { method, parameter, metric, order, tail, points: mine.len() });
        }
    }
    all
}

/// The exponent of error − limit from the last three points: with x growing by r each time, (e₁ − e₂)/(e₂ − e₃) = r⁻ᵖ.
fn tail(points: &[(f64, f64)]) -> Option<f64> {
    let [.., a, b, c] = points else { return None };
    let (r, even) = (b.0 / a.0, (b.0 / a.0 / (c.0 / b.0) - 1.0).abs() < 0.01);
    let (first, second) = (a.1 - b.1, b.1 - c.1);
    (even && first > second && second > 0.0).then(|| -(first / second).ln() / r.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::curve::How;
    use crate::study::measure::ViewRun;
    use crate::study::state::TruthNote;
    use crate::study::sweep::{Base, Setting};

    /// A run whose squared error is `e²` everywhere and whose FLIP is `e`.
    fn run(method: Method, parameter: Parameter, value: f64, seconds: f64, e: f32) -> Run {
        let block = Block {
            pixels: 4.0,
            flip: 4.0 * e,
            squared: 12.0 * e * e,
            kept: 4.0,
            relative: 4.0 * e * e,
            windows: 4.0,
            similarity: 4.0 * (1.0 - e),
        };
        let frame = Seconds { wall_s: seconds, cpu_s: 2.0 * seconds };
        let view = ViewRun { view: "v".to_owned(), frame, blocks: vec![block; 4], whole: None, parts: None };
        let setup = Seconds { wall_s: 3.0, cpu_s: 6.0 };
        Run {
            setting: Setting { method, parameter, value },
            setup,
            views: vec![view],
            volume: true,
            radius_m: None,
            spent_s: 1.0,
        }
    }

    fn example() -> Study {
        let tracing = |n: f64| run(Method::PathTracing, Parameter::Samples, n, n, (0.8 / n.sqrt()) as f32);
        let mut runs: Vec<Run> = [16.0, 1.0, 4.0, 64.0].map(tracing).into();
        runs.push(run(Method::Ibs, Parameter::AsItComes, 0.0, 0.5, 0.05));
        runs.push(run(Method::Ibs, Parameter::Samples, 1.0, 0.2, 0.2));
        runs.push(run(Method::Ibs, Parameter::Samples, 16.0, 2.0, 0.04));
        runs.push(run(Method::Ibs, Parameter::Cells, 32.0, 0.4, 0.0501));
        let truth = TruthNote { kind: "photographs".to_owned(), samples: None, noise_rmse: None, noise_flip: None };
        Study {
            fingerprint: String::new(),
            site: "s".to_owned(),
            lighting: String::new(),
            threads: 2,
            processor_time: true,
            share: 1.0,
            truth,
            base: Base { width: 64, probes: 1, cells: 64, rays: 192, samples: 4 },
            order: vec![],
            blocks: vec![4],
            runs,
            pending: vec![],
            notes: vec![],
            summary: None,
        }
    }

    /// A file in which a view has 2⁶³ blocks had made room for as many.
    #[test]
    fn a_study_of_other_blocks_is_not_taken_up() {
        let study = example();
        assert!(study.is_of(&[4]));
        assert!(!study.is_of(&[5]) && !study.is_of(&[4, 4]));
        for blocks in [1 << 63, 1_000_000_000] {
            assert!(!Study { blocks: vec![blocks], ..example() }.is_of(&[4]));
        }
        let mut short = example();
        short.runs[0].views[0].blocks.pop();
        assert!(!short.is_of(&[4]));
    }

    #[test]
    fn equal_error_and_equal_time_follow_the_power_law() {
        let s = summary(&example(), &[], "render sites/s");
        let flip = s.speed_ups.iter().find(|s| s.metric == Metric::Flip).unwrap();
        // 0.8/√n = 0.05 at n = 256 samples = 512 processor seconds, beyond the last point
        assert!((flip.needed_cpu_s / 512.0 - 1.0).abs() < 1e-5 && flip.how == How::Extrapolated, "{flip:?}");
        assert!((flip.frame.value / 512.0 - 1.0).abs() < 1e-5 && (flip.frame_wall.unwrap() / 512.0 - 1.0).abs() < 1e-5);
        assert!((flip.with_setup.value / (518.0 / 7.0) - 1.0).abs() < 1e-5);
        let equal = |with| s.equal_time.iter().find(|e| e.metric == Metric::Flip && e.with_setup == with).unwrap();
        assert_eq!(equal(false).how, How::First);
        assert!((equal(false).ratio.value - 16.0).abs() < 1e-5);
        // 7 s less 6 s of set-up leave less than one sample
        assert_eq!(equal(true).how, How::First);
    }

    #[test]
    fn rows_are_sorted_and_the_front_and_orders_are_found() {
        let s = summary(&example(), &[], "render sites/s");
        let names: Vec<_> = s.rows.iter().map(|r| format!("{} {}", r.setting.method.name(), r.label)).collect();
        assert_eq!(names[..2], ["ibs default settings", "ibs 32 volume cells"]);
        assert!(
            s.rows.iter().filter(|r| r.setting.method == Method::PathTracing).all(|r| !r.pareto || r.frame.cpu_s > 4.0)
        );
        let traced =
            s.convergence.iter().find(|c| c.method == Method::PathTracing && c.metric == Metric::Rmse).unwrap();
        assert!((traced.order.value + 0.5).abs() < 1e-6 && traced.points == 4);
        let recommended = s.recommended.unwrap();
        assert!(recommended.snippet.contains("render sites/s"), "{}", recommended.snippet);
        assert!((tail(&[(1.0, 1.5), (2.0, 1.25), (4.0, 1.125)]).unwrap() + 1.0).abs() < 1e-12, "1 + ½/x");
    }
}

//! A small writer of diagrams as SVG: panels side by side with linear or logarithmic axes, lines, markers, bands at the
//! bottom, and one legend. Colours are told apart without colour vision (Okabe and Ito 2008); the ground is white.

use std::fmt::Write;

/// How an axis runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By powers of ten.
    Log,
}

/// What a series is drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line.
    Line,
    /// A line of dashes.
    Dashes,
    /// A wide pale line, below all others.
    Front,
    /// A disc at each point.
    Disc,
    /// A ring at each point.
    Ring,
}

/// Points drawn in one way.
#[derive(Clone, Debug)]
pub struct Series {
    /// What the legend calls it; empty: not in the legend.
    pub name: String,
    /// Which colour, of 8.
    pub color: usize,
    /// How it is drawn.
    pub mark: Mark,
    /// Its points; those that an axis cannot show are left out.
    pub points: Vec<(f64, f64)>,
}

/// One diagram of a figure.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Below the x axis, with its unit.
    pub x: String,
    /// Beside the y axis, with its unit.
    pub y: String,
    /// How x runs.
    pub x_scale: Scale,
    /// How y runs.
    pub y_scale: Scale,
    /// Bounds of y; absent: what the series take.
    pub y_bounds: Option<(f64, f64)>,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Black, orange, sky, green, yellow, blue, vermilion, purple.
const COLORS: [&str; 8] = ["#000000", "#e69f00", "#56b4e9", "#009e73", "#b8a800", "#0072b2", "#d55e00", "#cc79a7"];
const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 290.0;
/// Around a panel: left, top, right, bottom.
const EDGE: [f64; 4] = [66.0, 34.0, 16.0, 50.0];
const TOP: f64 = 40.0;

struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Axis {
    fn new(scale: Scale, values: impl Iterator<Item = f64>, bounds: Option<(f64, f64)>) -> Self {
        let shown = |v: &f64| v.is_finite() && (scale == Scale::Linear || *v > 0.0);
        let (mut low, mut high) = bounds.unwrap_or_else(|| {
            values.filter(shown).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
        });
        if low > high {
            (low, high) = (1.0, 10.0);
        }
        if scale == Scale::Log {
            (low, high) = (low.log10(), high.log10());
        }
        let room = if bounds.is_some() { 0.0 } else { 0.05 * (high - low).max(1e-9) };
        Self { scale, low: low - room, high: high + room }
    }

    /// From 0 to 1 within the panel.
    fn at(&self, value: f64) -> Option<f64> {
        let v = match self.scale {
            Scale::Linear => value,
            Scale::Log if value > 0.0 => value.log10(),
            Scale::Log => return None,
        };
        let t = (v - self.low) / (self.high - self.low);
        (t.is_finite() && (-1e-9..=1.0 + 1e-9).contains(&t)).then_some(t)
    }

    fn ticks(&self) -> Vec<(f64, String)> {
        let span = self.high - self.low;
        if self.scale == Scale::Log {
            let decades = self.low.ceil() as i32..=self.high.floor() as i32;
            if span > 2.2 {
                let each = (span / 7.0).ceil() as i32;
                return decades.filter(|d| d % each == 0).map(|d| (10f64.powi(d), power(d))).collect();
            }
            let from = self.low.floor() as i32..=self.high.ceil() as i32;
            let all = from.flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
            return all.filter(|v| self.at(*v).is_some()).map(|v| (v, number(v))).collect();
        }
        let raw = span / 5.0;
        let unit = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].iter().map(|m| m * unit).find(|s| *s >= raw).unwrap_or(raw);
        let first = (self.low / step).ceil() as i64;
        (first..=(self.high / step).floor() as i64)
            .map(|i| i as f64 * step)
            .map(|v| (v, number((v / step).round() * step)))
            .collect()
    }
}

fn power(decade: i32) -> String {
    if (-2..=3).contains(&decade) {
        return number(10f64.powi(decade));
    }
    format!("10<tspan dy=\"-4\" font-size=\"8\">{decade}</tspan>")
}

fn number(v: f64) -> String {
    let text = format!("{v:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A figure of panels, at most `columns` beside each other, and what is said below.
pub fn figure(title: &str, note: &str, panels: &[Panel], columns: usize) -> String {
    let columns = columns.clamp(1, panels.len().max(1));
    let rows = panels.len().div_ceil(columns);
    let mut names: Vec<(&str, usize, Mark)> = Vec::new();
    for s in panels.iter().flat_map(|p| &p.series) {
        if !s.name.is_empty() && !names.iter().any(|n| n.0 == s.name) {
            names.push((&s.name, s.color, s.mark));
        }
    }
    let width = WIDTH * columns as f64;
    let (legend, legend_height) = legend(&names, width);
    let notes: Vec<&str> = note.lines().collect();
    let height = TOP + legend_height + HEIGHT * rows as f64 + 16.0 * notes.len() as f64 + 8.0;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"11\" fill=\"#222\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"12\" y=\"25\" font-size=\"15\" font-weight=\"bold\">{}</text>\n<g transform=\"translate(0 {TOP})\">{legend}</g>",
        escaped(title)
    );
    for (i, p) in panels.iter().enumerate() {
        let (x, y) = (WIDTH * (i % columns) as f64, TOP + legend_height + HEIGHT * (i / columns) as f64);
        let _ = writeln!(out, "<g transform=\"translate({x} {y})\">{}</g>", panel(p));
    }
    for (i, line) in notes.iter().enumerate() {
        let y = height - 8.0 - 16.0 * (notes.len() - 1 - i) as f64;
        let _ = writeln!(out, "<text x=\"12\" y=\"{y}\" fill=\"#555\">{}</text>", escaped(line));
    }
    out + "</svg>\n"
}

fn legend(names: &[(&str, usize, Mark)], width: f64) -> (String, f64) {
    let (mut x, mut y, mut out) = (12.0, 10.0, String::new());
    for (name, color, mark) in names {
        let wide = 44.0 + 6.6 * name.chars().count() as f64;
        if x + wide > width && x > 12.0 {
            (x, y) = (12.0, y + 17.0);
        }
        let alone = matches!(mark, Mark::Disc | Mark::Ring);
        let places = if alone { vec![(x + 14.0, y)] } else { vec![(x, y), (x + 22.0, y)] };
        out += &drawn(*mark, COLORS[color % 8], &places);
        let _ = write!(out, "<text x=\"{}\" y=\"{}\">{}</text>", x + 28.0, y + 4.0, escaped(name));
        x += wide;
    }
    (out, if names.is_empty() { 0.0 } else { y + 10.0 })
}

fn drawn(mark: Mark, color: &str, points: &[(f64, f64)]) -> String {
    let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let line = |style: &str| {
        format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-linejoin=\"round\" {style}/>",
            path.join(" ")
        )
    };
    let dots = |style: String| {
        points.iter().map(|(x, y)| format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" {style}/>")).collect::<String>()
    };
    match mark {
        Mark::Line => line("stroke-width=\"1.6\""),
        Mark::Dashes => line("stroke-width=\"1.2\" stroke-dasharray=\"5 3\""),
        Mark::Front => line("stroke-width=\"9\" stroke-opacity=\"0.18\" stroke-linecap=\"round\""),
        Mark::Disc => dots(format!("r=\"2.6\" fill=\"{color}\"")),
        Mark::Ring => dots(format!("r=\"4.4\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.2\"")),
    }
}

fn panel(p: &Panel) -> String {
    let values = |of: fn(&(f64, f64)) -> f64| p.series.iter().flat_map(|s| &s.points).map(of);
    let x = Axis::new(p.x_scale, values(|v| v.0), None);
    let y = Axis::new(p.y_scale, values(|v| v.1), p.y_bounds);
    let (w, h) = (WIDTH - EDGE[0] - EDGE[2], HEIGHT - EDGE[1] - EDGE[3]);
    let (px, py) = (|t: f64| EDGE[0] + t * w, |t: f64| EDGE[1] + (1.0 - t) * h);
    let mut out = String::new();
    for (v, text) in x.ticks() {
        let at = px(x.at(v).unwrap_or(0.0));
        let _ = write!(
            out,
            "<path d=\"M{at:.1} {:.1}V{:.1}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
            py(0.0),
            py(1.0),
            py(0.0) + 15.0
        );
    }
    for (v, text) in y.ticks() {
        let at = py(y.at(v).unwrap_or(0.0));
        let _ = write!(
            out,
            "<path d=\"M{:.1} {at:.1}H{:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
            px(0.0),
            px(1.0),
            px(0.0) - 5.0,
            at + 4.0
        );
    }
    let _ = write!(
        out,
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"none\" stroke=\"#888\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-weight=\"bold\">{}</text>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        px(0.0),
        py(1.0),
        px(0.5),
        py(1.0) - 8.0,
        escaped(&p.title),
        px(0.5),
        py(0.0) + 33.0,
        escaped(&p.x),
        py(0.5),
        escaped(&p.y)
    );
    let order = |s: &&Series| usize::from(s.mark != Mark::Front);
    let mut series: Vec<&Series> = p.series.iter().collect();
    series.sort_by_key(order);
    for s in series {
        // A line is broken where it leaves the panel.
        let places: Vec<Option<(f64, f64)>> =
            s.points.iter().map(|(a, b)| Some((px(x.at(*a)?), py(y.at(*b)?)))).collect();
        for part in places.split(Option::is_none) {
            let part: Vec<_> = part.iter().flatten().copied().collect();
            if !part.is_empty() {
                out += &drawn(s.mark, COLORS[s.color % 8], &part);
            }
        }
    }
    out
}

/// Points that none beats: less `y` than every point of as little or less `x`.
pub fn pareto(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<_> = points.iter().copied().filter(|p| p.1.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for p in sorted {
        if front.last().is_none_or(|last| p.1 < last.1) {
            front.push(p);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [(2.0, 3.0), (1.0, 5.0), (2.0, 4.0), (3.0, 3.5), (4.0, 1.0), (5.0, f64::NAN)];
        assert_eq!(pareto(&points), [(1.0, 5.0), (2.0, 3.0), (4.0, 1.0)]);
    }

    #[test]
    fn a_figure_is_whole_and_says_what_it_is_given() {
        let series = |name: &str, mark| Series {
            name: name.into(),
            color: 1,
            mark,
            points: vec![(1.0, 1e-4), (10.0, 0.0), (100.0, 1e-2)],
        };
        let panel = Panel {
            title: "a < b".into(),
            x: "NFE".into(),
            y: "error [%]".into(),
            x_scale: Scale::Log,
            y_scale: Scale::Log,
            y_bounds: None,
            series: vec![series("one", Mark::Line), series("two", Mark::Ring)],
        };
        let svg = figure("title", "note", &[panel.clone(), panel], 2);
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("fill=\"#fff\""));
        for text in ["title", "note", "a &lt; b", "NFE", "error [%]", "one", "two"] {
            assert!(svg.contains(text), "{text}");
        }
        // A logarithmic axis leaves 0 out: two rings in each panel, and one in the legend.
        assert_eq!(svg.matches("<circle").count(), 2 * 2 + 1);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}

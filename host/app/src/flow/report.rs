//! What a run says of its flow, beside the paper's figures. Does not know how it came about.

use physvideo::scene::Flow;
use serde::Serialize;

use super::chunk_report::ClipReport;

/// The paper's run times on one RTX 3090 (supplement, inference-time analysis).
const PAPER: Paper = Paper { overhead_s: 78.0, chunk_s: 258.0, nfe: 50, seconds_per_nfe: 5.1629 };

/// Run times of the paper for the act animate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Paper {
    /// Simulation and rendering with 50 k particles [s].
    pub overhead_s: f64,
    /// Φ_CF of one chunk of 36 frames [s].
    pub chunk_s: f64,
    /// Evaluations of v_θ of a chunk.
    pub nfe: u32,
    /// [s].
    pub seconds_per_nfe: f64,
}

/// The flow of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlowReport {
    /// Name of the model.
    pub model: String,
    /// Terms of its weights.
    pub licence: String,
    /// The scene's prompt.
    pub prompt: String,
    /// The scene's settings, with their defaults.
    pub settings: Flow,
    /// Size of its frames [px].
    pub size: [u32; 2],
    /// Whether it went on from a checkpoint; what the earlier run did is counted, but for its wall time.
    pub resumed: bool,
    /// Evaluations of v_θ in inversion, SDE and generation, and in all.
    pub nfe: Nfe,
    /// Wall time inside the network for each evaluation [s].
    pub seconds_per_nfe: f64,
    /// Time of the latent's arithmetic by the device's clock over the network's wall time.
    pub arithmetic_share: f64,
    /// Wall time before the flow: simulation, drawing and what they need [s].
    pub overhead_s: f64,
    /// Wall time of the flow [s].
    pub wall_s: f64,
    /// Noise level, β and chunks.
    #[serde(flatten)]
    pub clip: ClipReport,
    /// The same in the paper.
    pub paper: Paper,
}

/// Evaluations of v_θ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Nfe {
    /// Lines 3–5 of Algorithm 1.
    pub inversion: u32,
    /// Lines 9–13.
    pub sde: u32,
    /// Lines 14–16.
    pub generation: u32,
    /// All.
    pub total: u32,
}

impl FlowReport {
    /// A report; `overhead_s` is what came before.
    pub fn new(
        flow: &Flow,
        (model, licence): (&str, &str),
        size: (u32, u32),
        clip: ClipReport,
        (overhead_s, wall_s): (f64, f64),
    ) -> Self {
        let sum = |i: usize| clip.chunks.iter().map(|c| c.nfe[i]).sum();
        let (inversion, sde, generation) = (sum(0), sum(1), sum(2));
        let nfe = Nfe { inversion, sde, generation, total: inversion + sde + generation };
        let network: f64 = clip.chunks.iter().map(|c| c.network_s).sum();
        let arithmetic: f64 = clip.chunks.iter().map(|c| c.arithmetic_s).sum();
        let per = |s: f64, n: f64| if n > 0.0 { s / n } else { 0.0 };
        Self {
            model: model.into(),
            licence: licence.into(),
            prompt: flow.prompt.clone(),
            settings: flow.clone(),
            size: [size.0, size.1],
            resumed: false,
            seconds_per_nfe: per(network, f64::from(nfe.total)),
            arithmetic_share: per(arithmetic, network),
            nfe,
            overhead_s,
            wall_s,
            clip,
            paper: PAPER,
        }
    }

    /// The paper's table of run times with this run beside it.
    pub fn table(&self) -> String {
        let chunks = self.clip.chunks.len().max(1) as f64;
        let each = self.nfe.total / (chunks as u32);
        let Paper { overhead_s, chunk_s, nfe, seconds_per_nfe } = self.paper;
        let [w, h] = self.size;
        format!(
            "run time             here      paper (RTX 3090, FramePack)\n\
             overhead       {:>10}   {:>8}\n\
             flow, a chunk  {:>10}   {:>8}\n\
             evaluations    {each:>10}   {nfe:>8}\n\
             one of them    {:>8.3} s   {seconds_per_nfe:>6.3} s\n\
             {} at {w} × {h}; arithmetic of the latent {:.2} % of the network's time",
            time(self.overhead_s),
            time(overhead_s),
            time(self.wall_s / chunks),
            time(chunk_s),
            self.seconds_per_nfe,
            self.model,
            100.0 * self.arithmetic_share,
        )
    }
}

fn time(seconds: f64) -> String {
    if seconds < 60.0 { format!("{seconds:.1} s") } else { format!("{:.1} min", seconds / 60.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ChunkReport;

    #[test]
    fn evaluations_are_counted_by_phase_and_shares_follow() {
        let chunk = ChunkReport { nfe: [20, 10, 20], network_s: 10.0, arithmetic_s: 0.05, ..Default::default() };
        let clip = ClipReport { chunks: vec![chunk.clone(), chunk], ..Default::default() };
        let flow: Flow = toml::from_str("model = 'm'").unwrap();
        let report = FlowReport::new(&flow, ("m", "free"), (64, 48), clip, (66.0, 30.0));
        assert_eq!(report.nfe, Nfe { inversion: 40, sde: 20, generation: 40, total: 100 });
        assert!((report.seconds_per_nfe - 0.2).abs() < 1e-12 && (report.arithmetic_share - 0.005).abs() < 1e-12);
        let table = report.table();
        assert!(table.contains("1.1 min") && table.contains("1.3 min") && table.contains("15.0 s"), "{table}");
        assert!(table.contains("4.3 min") && table.contains("0.50 %"), "{table}");
    }
}

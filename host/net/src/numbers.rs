//! Numbers a network is told: noise level, guidance, sizes, positions in time. Knows no latent.

use crate::array::Array;
use crate::error::NetError;
use crate::manifest::{ChunkSpec, Direction, Dtype, FirstLatent, Grid, Part, Per};

/// A number as a tensor: once, for the batch, or for each token. With `clamped`, tokens of latent 0 get 0.
pub(crate) fn number(value: f64, per: Per, grid: Grid, clamped: bool, dtype: Dtype) -> Result<Array, NetError> {
    let (shape, data) = match per {
        Per::Scalar => (Vec::new(), vec![value]),
        Per::Batch => (vec![1], vec![value]),
        Per::Token { patch } => {
            let tokens = grid.tokens(patch)?;
            let first = if clamped { tokens / (grid.frames / patch[0]) } else { 0 };
            let mut data = vec![value; tokens];
            data.iter_mut().take(first).for_each(|v| *v = 0.0);
            (vec![1, tokens], data)
        }
    };
    Ok(Array::from_f64(shape, &data, dtype))
}

/// Whether tokens of latent 0 are told noise level 0.
pub(crate) fn clamped(first: FirstLatent) -> bool {
    first == FirstLatent::Clamped
}

/// Positions of parts on the model's axis of time: [first][history][latents] forward,
/// [first][padding][latents][history] backward.
pub(crate) fn indices(of: &[Part], chunk: &ChunkSpec, frames: usize, padding: usize, dtype: Dtype) -> Array {
    let mut at: Vec<usize> = Vec::new();
    let forward = chunk.direction == Direction::Forward;
    let latents = if forward { 1 + chunk.history } else { 1 + padding };
    for part in of {
        match part {
            Part::Latents => at.extend(latents..latents + frames),
            // Chronological: forward the nearest is the last, backward the first.
            Part::History(slots) if forward => {
                let end = latents.saturating_sub(slots.nearest);
                at.extend(end.saturating_sub(slots.count)..end);
            }
            Part::History(slots) => {
                let start = latents + frames + slots.nearest;
                at.extend(start..start + slots.count);
            }
            Part::First | Part::Image | Part::Mask => at.push(0),
        }
    }
    let data: Vec<f64> = at.iter().map(|&i| i as f64).collect();
    Array::from_f64(vec![1, data.len()], &data, dtype)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::Numbers;
    use crate::manifest::HistorySlots;

    fn chunk(direction: Direction) -> ChunkSpec {
        ChunkSpec { frames: 37, fixed: false, direction, history: 19, history_includes_first: false }
    }

    fn history(nearest: usize, count: usize) -> Part {
        Part::History(HistorySlots { nearest, count })
    }

    fn at(of: &[Part], direction: Direction, padding: usize) -> Vec<i64> {
        match indices(of, &chunk(direction), 9, padding, Dtype::I64).numbers {
            Numbers::I64(v) => v,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn positions_of_framepack() {
        // demo_gradio.py: [1, padding, 9, 1, 2, 16].
        assert_eq!(at(&[Part::Latents], Direction::Backward, 27), (28..37).collect::<Vec<_>>());
        assert_eq!(at(&[Part::First, history(0, 1)], Direction::Backward, 27), [0, 37]);
        assert_eq!(at(&[history(1, 2)], Direction::Backward, 27), [38, 39]);
        assert_eq!(at(&[history(3, 16)], Direction::Backward, 27), (40..56).collect::<Vec<_>>());
        // demo_gradio_f1.py: [1, 16, 2, 1, 9].
        assert_eq!(at(&[Part::Latents], Direction::Forward, 0), (20..29).collect::<Vec<_>>());
        assert_eq!(at(&[Part::First, history(0, 1)], Direction::Forward, 0), [0, 19]);
        assert_eq!(at(&[history(1, 2)], Direction::Forward, 0), [17, 18]);
        assert_eq!(at(&[history(3, 16)], Direction::Forward, 0), (1..17).collect::<Vec<_>>());
    }

    #[test]
    fn tokens_of_a_clamped_latent_are_clean() {
        let grid = Grid { frames: 3, height: 4, width: 2 };
        let of = |per, clamped| match number(0.5, per, grid, clamped, Dtype::F32).unwrap() {
            Array { shape, numbers: Numbers::F32(v) } => (shape, v),
            other => panic!("{other:?}"),
        };
        assert_eq!(of(Per::Scalar, true), (vec![], vec![0.5]));
        assert_eq!(of(Per::Batch, true), (vec![1], vec![0.5]));
        let (shape, v) = of(Per::Token { patch: [1, 2, 2] }, true);
        assert_eq!((shape, v), (vec![1, 6], vec![0.0, 0.0, 0.5, 0.5, 0.5, 0.5]));
        assert_eq!(of(Per::Token { patch: [1, 1, 1] }, false).1, vec![0.5; 24]);
        assert!(number(0.5, Per::Token { patch: [2, 1, 1] }, grid, false, Dtype::F32).is_err());
    }
}

//! Orders of axes at the border of a graph; inside, latents and frames are [C, T, h, w]. Knows no graph.

use crate::manifest::Layout;

/// The shape a graph sees, batch included.
pub(crate) fn shape(axes: [usize; 4], layout: Layout) -> Vec<usize> {
    let [c, t, h, w] = axes;
    match layout {
        Layout::Bcthw => vec![1, c, t, h, w],
        Layout::Btchw => vec![1, t, c, h, w],
        Layout::Bnc => vec![1, t * h * w, c],
    }
}

/// Canonical numbers in the order a graph wants. `data` has as many numbers as `axes` say.
pub(crate) fn to_graph(data: &[f32], axes: [usize; 4], layout: Layout) -> Vec<f32> {
    let [c, t, h, w] = axes;
    match layout {
        Layout::Bcthw => data.to_vec(),
        Layout::Btchw => swap_blocks(data, c, t, h * w),
        Layout::Bnc => swap_blocks(data, c, t * h * w, 1),
    }
}

/// The numbers of a graph in canonical order. `data` has as many numbers as `axes` say.
pub(crate) fn from_graph(data: Vec<f32>, axes: [usize; 4], layout: Layout) -> Vec<f32> {
    let [c, t, h, w] = axes;
    match layout {
        Layout::Bcthw => data,
        Layout::Btchw => swap_blocks(&data, t, c, h * w),
        Layout::Bnc => swap_blocks(&data, t * h * w, c, 1),
    }
}

/// [a, b, block] to [b, a, block].
fn swap_blocks(data: &[f32], a: usize, b: usize, block: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(data.len());
    for j in 0..b {
        for i in 0..a {
            let start = (i * b + j) * block;
            out.extend_from_slice(data.get(start..start + block).unwrap_or_default());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_go_there_and_back() {
        let axes = [2, 3, 2, 5];
        let data: Vec<f32> = (0..60).map(|i| i as f32).collect();
        for layout in [Layout::Bcthw, Layout::Btchw, Layout::Bnc] {
            let there = to_graph(&data, axes, layout);
            assert_eq!(shape(axes, layout).iter().product::<usize>(), there.len());
            assert_eq!(from_graph(there, axes, layout), data);
        }
        // Channel 1, time 2, row 1, column 3.
        let value = data[((3 + 2) * 2 + 1) * 5 + 3];
        assert_eq!(to_graph(&data, axes, Layout::Btchw)[((2 * 2 + 1) * 2 + 1) * 5 + 3], value);
        assert_eq!(to_graph(&data, axes, Layout::Bnc)[((2 * 2 + 1) * 5 + 3) * 2 + 1], value);
    }
}

//! How a clip's frames are cut into chunks. Knows no latents and no network.

/// A stretch of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    pub first: usize,
    /// Frames of the clip in it.
    pub frames: usize,
    /// Frames given to the network: the last one is repeated.
    pub padded: usize,
}

pub(super) fn stretches(frames: usize, chunk: usize, temporal: usize, fixed: bool) -> Vec<Stretch> {
    let step = (chunk - 1).max(1);
    let count = frames.saturating_sub(1).div_ceil(step).max(1);
    let one = |k: usize| {
        let first = k * step;
        let frames = chunk.min(frames - first);
        let padded = if fixed { chunk } else { 1 + (frames - 1).div_ceil(temporal) * temporal };
        Stretch { first, frames, padded }
    };
    (0..count).map(one).collect()
}

/// Chunks that FramePack leaves room for between the image and chunk `k` of `count`; long clips squeeze the middle.
pub(super) fn padding(k: usize, count: usize) -> usize {
    if count <= 4 || k <= 1 {
        k
    } else if k == count - 1 {
        3
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_of_109_frames_is_three_chunks_that_share_frames() {
        let all = stretches(109, 37, 4, false);
        assert_eq!(
            all.iter().map(|s| (s.first, s.frames, s.padded)).collect::<Vec<_>>(),
            [(0, 37, 37), (36, 37, 37), (72, 37, 37)]
        );
        let short = stretches(40, 37, 4, false);
        assert_eq!((short[1].first, short[1].frames, short[1].padded), (36, 4, 5));
        assert_eq!(stretches(40, 37, 4, true)[1].padded, 37);
        assert_eq!(stretches(1, 37, 4, false), [Stretch { first: 0, frames: 1, padded: 1 }]);
        assert_eq!(stretches(37, 37, 4, false).len(), 1);
    }

    #[test]
    fn framepack_leaves_room_as_its_authors_do() {
        assert_eq!((0..3).rev().map(|k| padding(k, 3)).collect::<Vec<_>>(), [2, 1, 0]);
        assert_eq!((0..6).rev().map(|k| padding(k, 6)).collect::<Vec<_>>(), [3, 2, 2, 2, 1, 0]);
    }
}

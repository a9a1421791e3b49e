//! Frames to an H.264 MP4 that every player shows. Does not know where frames come from.

use std::path::{Path, PathBuf};

use muxide::api::{Muxer, MuxerBuilder, MuxerError, VideoCodec};
use openh264::OpenH264API;
use openh264::encoder::{
    BitRate, Complexity, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange, RateControlMode,
    VuiConfig,
};

use super::frames::check_rgb;
use super::yuv::Yuv420;
use super::{WholeFile, WriteError};

/// Encodes 8-bit sRGB frames one by one; the file appears at `finish`.
///
/// yuv420p, BT.709 limited range (said in the stream's VUI), even size (odd ones repeat their last row or column),
/// index before the data, a key frame at least every two seconds.
pub struct VideoWriter {
    path: PathBuf,
    width: u32,
    height: u32,
    fps: f64,
    yuv: Yuv420,
    encoder: Encoder,
    muxer: Muxer<WholeFile>,
    frames: u64,
}

/// What a finished video holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VideoSummary {
    /// Encoded size [px].
    pub width: u32,
    pub height: u32,
    pub frames: u64,
    /// Length of the clip [s].
    pub seconds: f64,
}

/// H.264 quantiser of a frame; of a change of scene up to two more. 20 gives
/// about 2 Mbit/s for a photograph at 640 × 554 and 24 frames a second.
const QUANTISER: u8 = 20;

/// Limits of the encoder.
const LONGER_SIDE: u32 = 3840;
const SHORTER_SIDE: u32 = 2160;
const LEAST_SIDE: u32 = 16;

impl VideoWriter {
    /// Begins a video of frames of `width × height` shown at `fps` frames a second, whole or not.
    pub fn new(path: &Path, width: u32, height: u32, fps: f64) -> Result<Self, WriteError> {
        let limit = |what, advice| WriteError::VideoLimit { path: path.into(), what, advice };
        if width.min(height) < LEAST_SIDE || width.max(height) > LONGER_SIDE || width.min(height) > SHORTER_SIDE {
            let what = format!("a video of {width} × {height} cannot be encoded");
            return Err(limit(
                what,
                "Choose a size from 16 × 16 to 3840 × 2160 (or 2160 × 3840), or output frames only.",
            ));
        }
        if !(0.1..=1000.0).contains(&fps) {
            return Err(limit(format!("a video of {fps} frames a second cannot be encoded"), "Choose 0.1 to 1000."));
        }
        let yuv = Yuv420::new(width, height);
        let (coded_width, coded_height) = yuv.size();
        let config = EncoderConfig::new()
            // The name misleads: in this mode the quantiser alone decides, within its range, whatever the bits. Quality
            // mode follows a bit rate and drops frames or complains; with rate control off the range is ignored.
            .rate_control_mode(RateControlMode::Bufferbased)
            .qp(QpRange::new(QUANTISER, QUANTISER + 2))
            .adaptive_quantization(false)
            // Not followed in this mode, but must be plausible, as must the rate; times are the container's.
            .bitrate(BitRate::from_bps(2_000_000))
            .max_frame_rate(FrameRate::from_hz(fps.clamp(1.0, 60.0) as f32))
            .intra_frame_period(IntraFramePeriod::from_num_frames((2.0 * fps).ceil() as u32))
            .complexity(Complexity::Medium)
            .vui(VuiConfig::bt709())
            // Every frame is coded, still ones too, on one thread: the same frames give the same bytes.
            .skip_frames(false)
            .background_detection(false)
            .num_threads(1);
        let encoder =
            Encoder::with_api_config(OpenH264API::from_source(), config).map_err(|e| WriteError::encoder(path, e))?;
        let muxer = MuxerBuilder::new(WholeFile::create(path)?)
            .video(VideoCodec::H264, coded_width, coded_height, fps)
            .with_fast_start(true)
            .build()
            .map_err(|e| container(path, e))?;
        Ok(Self { path: path.into(), width, height, fps, yuv, encoder, muxer, frames: 0 })
    }

    /// Adds a frame: rows from the top, `rgb.len() = 3 · width · height`.
    pub fn push(&mut self, rgb: &[u8]) -> Result<(), WriteError> {
        check_rgb(&self.path, self.width, self.height, rgb)?;
        self.yuv.fill(rgb, self.width, self.height);
        // From the frame's number each time, so that rounding to the container's clock does not add up.
        self.encode(self.frames as f64 / self.fps)?;
        self.frames += 1;
        Ok(())
    }

    /// Encodes what the planes hold as the picture shown from `time` [s] on.
    fn encode(&mut self, time: f64) -> Result<(), WriteError> {
        let stream = self.encoder.encode(&self.yuv).map_err(|e| WriteError::encoder(&self.path, e))?;
        let key = stream.frame_type() == FrameType::IDR;
        let bytes = stream.to_vec();
        if bytes.is_empty() {
            return Err(WriteError::encoder(&self.path, format!("frame {} was dropped", self.frames)));
        }
        self.muxer.write_video(time, &bytes, key).map_err(|e| container(&self.path, e))
    }

    /// Writes the file. A clip without frames is refused.
    pub fn finish(mut self) -> Result<VideoSummary, WriteError> {
        if self.frames == 0 {
            return Err(WriteError::EmptyClip { path: self.path });
        }
        if self.frames == 1 {
            // The container takes the last picture's length from the one before: a lone frame is shown twice, half its
            // time each.
            self.encode(0.5 / self.fps)?;
        }
        self.muxer.finish_in_place().map_err(|e| container(&self.path, e))?;
        self.muxer.into_writer().commit()?;
        let (width, height) = self.yuv.size();
        Ok(VideoSummary { width, height, frames: self.frames, seconds: self.frames as f64 / self.fps })
    }
}

fn container(path: &Path, error: MuxerError) -> WriteError {
    match error {
        MuxerError::Io(e) => WriteError::io(path, e),
        e => WriteError::encoder(path, e),
    }
}

//! One graph in ONNX Runtime: loading it and running it, so that the caller can stop both. Knows no manifest.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use half::{bf16, f16};
use ort::session::builder::SessionBuilder;
use ort::session::{RunOptions, SessionInputValue};
use ort::value::{DynValue, TensorElementType, TensorRef};

use crate::array::{Array, Numbers};
use crate::error::NetError;
use crate::library::{Provider, Runtime};

/// How often a watcher looks whether the caller wants to stop.
const LOOK: Duration = Duration::from_millis(10);

/// A tensor given to a graph.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Feed<'a> {
    /// Of any type.
    Array(&'a Array),
    /// Floats that lie elsewhere, read in place.
    InPlace { shape: &'a [usize], data: &'a [f32] },
}

impl Feed<'_> {
    pub fn shape(&self) -> &[usize] {
        match self {
            Self::Array(array) => &array.shape,
            Self::InPlace { shape, .. } => shape,
        }
    }
}

/// A graph that is loaded.
pub(crate) struct Session {
    path: PathBuf,
    session: ort::session::Session,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("path", &self.path).finish_non_exhaustive()
    }
}

impl Session {
    /// Loads a graph from its bytes. External data is looked for in the folder of `path`.
    pub fn load(runtime: &Runtime, path: &Path, bytes: &[u8], cancel: &AtomicBool) -> Result<Self, NetError> {
        let refuse = |why: String| NetError::Runtime { path: path.to_path_buf(), why };
        let folder = path.parent().map(std::fs::canonicalize).and_then(Result::ok).unwrap_or_default();
        let mut builder = builder(runtime, &folder).map_err(|e| refuse(e.to_string()))?;
        let canceler = builder.canceler();
        let stop = || {
            // Nothing is to be done about a load that cannot be stopped: it ends by itself.
            let _ = canceler.cancel();
        };
        let loaded = watched(cancel, stop, || builder.commit_from_memory(bytes));
        match loaded {
            Ok(session) => Ok(Self { path: path.to_path_buf(), session }),
            Err(_) if cancel.load(Ordering::Relaxed) => Err(NetError::Interrupted),
            Err(e) => Err(refuse(one_line(e.message()))),
        }
    }

    /// Runs the graph; gives the outputs asked for, in that order.
    pub fn run(
        &mut self,
        inputs: &[(&str, Feed<'_>)],
        outputs: &[&str],
        cancel: &AtomicBool,
    ) -> Result<Vec<DynValue>, NetError> {
        if cancel.load(Ordering::Relaxed) {
            return Err(NetError::Interrupted);
        }
        let path = &self.path;
        let refuse = |e: &ort::Error| NetError::Runtime { path: path.clone(), why: one_line(e.message()) };
        let values: Vec<(Cow<'_, str>, SessionInputValue<'_>)> = inputs
            .iter()
            .map(|(name, feed)| Ok((Cow::Borrowed(*name), input(feed)?)))
            .collect::<Result<_, ort::Error>>()
            .map_err(|e| refuse(&e))?;
        let options = RunOptions::new().map_err(|e| refuse(&e))?;
        let session = &mut self.session;
        let stop = || {
            // A run that cannot be stopped ends by itself.
            let _ = options.terminate();
        };
        let mut made = match watched(cancel, stop, || session.run_with_options(values, &options)) {
            Ok(made) => made,
            Err(_) if cancel.load(Ordering::Relaxed) => return Err(NetError::Interrupted),
            Err(e) => return Err(refuse(&e)),
        };
        let missing = |name: &str| NetError::Contract {
            path: path.clone(),
            tensor: name.to_owned(),
            why: "is no output of the graph".into(),
        };
        outputs.iter().map(|name| made.remove(name).ok_or_else(|| missing(name))).collect()
    }
}

fn builder(runtime: &Runtime, folder: &Path) -> Result<SessionBuilder, ort::Error> {
    let builder = ort::session::Session::builder()?;
    let mut builder = match runtime.provider {
        Provider::Cpu => builder.with_execution_providers([ort::ep::CPU::default().build().error_on_failure()])?,
        Provider::Cuda => builder.with_execution_providers([ort::ep::CUDA::default().build().error_on_failure()])?,
    };
    if let Some(threads) = runtime.threads {
        builder = builder.with_intra_threads(threads.max(1))?;
    }
    // No other format, which is not looked at before.
    builder = builder.with_config_entry("session.load_model_format", "ONNX")?;
    // Idle threads give way to what follows the call.
    builder = builder.with_config_entry("session.force_spinning_stop", "1")?;
    builder = builder.with_deterministic_compute(true)?;
    let folder = folder.to_string_lossy();
    Ok(builder.with_config_entry("session.model_external_initializers_file_folder_path", folder)?)
}

fn input<'a>(feed: &Feed<'a>) -> Result<SessionInputValue<'a>, ort::Error> {
    let shape = feed.shape().to_vec();
    Ok(match feed {
        Feed::InPlace { data, .. } => TensorRef::from_array_view((shape, *data))?.into(),
        Feed::Array(array) => match &array.numbers {
            Numbers::F32(v) => TensorRef::from_array_view((shape, v.as_slice()))?.into(),
            Numbers::F16(v) => TensorRef::from_array_view((shape, v.as_slice()))?.into(),
            Numbers::Bf16(v) => TensorRef::from_array_view((shape, v.as_slice()))?.into(),
            Numbers::I64(v) => TensorRef::from_array_view((shape, v.as_slice()))?.into(),
            Numbers::I32(v) => TensorRef::from_array_view((shape, v.as_slice()))?.into(),
            Numbers::Bool(v) => TensorRef::from_array_view((shape, v.as_slice()))?.into(),
        },
    })
}

/// Copies an output as it is, so that the graph behind it can be dropped.
pub(crate) fn copy(value: &DynValue) -> Result<Array, String> {
    /// Shape and numbers of one type.
    fn of<T>(value: &DynValue) -> Result<(Vec<usize>, Vec<T>), String>
    where
        T: ort::value::PrimitiveTensorElementType + Copy,
    {
        let (shape, data) = value.try_extract_tensor::<T>().map_err(|e| one_line(e.message()))?;
        Ok((shape.iter().map(|&d| usize::try_from(d).unwrap_or(0)).collect(), data.to_vec()))
    }
    let (shape, numbers) = match value.dtype().tensor_type() {
        Some(TensorElementType::Float32) => of(value).map(|(s, v)| (s, Numbers::F32(v)))?,
        Some(TensorElementType::Float16) => of(value).map(|(s, v)| (s, Numbers::F16(v)))?,
        Some(TensorElementType::Bfloat16) => of(value).map(|(s, v)| (s, Numbers::Bf16(v)))?,
        Some(TensorElementType::Int64) => of(value).map(|(s, v)| (s, Numbers::I64(v)))?,
        Some(TensorElementType::Int32) => of(value).map(|(s, v)| (s, Numbers::I32(v)))?,
        other => return Err(format!("has numbers of type {other:?}, which cannot be passed on")),
    };
    Ok(Array { shape, numbers })
}

/// Copies an output as floats into a buffer that may be used again; gives its shape.
pub(crate) fn copy_floats(value: &DynValue, out: &mut Vec<f32>) -> Result<Vec<usize>, String> {
    out.clear();
    let told = |e: ort::Error| one_line(e.message());
    let shape = match value.dtype().tensor_type() {
        Some(TensorElementType::Float32) => {
            let (shape, data) = value.try_extract_tensor::<f32>().map_err(told)?;
            out.extend_from_slice(data);
            shape
        }
        Some(TensorElementType::Float16) => {
            let (shape, data) = value.try_extract_tensor::<f16>().map_err(told)?;
            out.extend(data.iter().map(|v| v.to_f32()));
            shape
        }
        Some(TensorElementType::Bfloat16) => {
            let (shape, data) = value.try_extract_tensor::<bf16>().map_err(told)?;
            out.extend(data.iter().map(|v| v.to_f32()));
            shape
        }
        other => return Err(format!("has numbers of type {other:?}, not floats")),
    };
    Ok(shape.iter().map(|&d| usize::try_from(d).unwrap_or(0)).collect())
}

/// Does some work, and calls `stop` once if the caller asks to stop meanwhile.
fn watched<T>(cancel: &AtomicBool, stop: impl Fn() + Sync, work: impl FnOnce() -> T) -> T {
    std::thread::scope(|scope| {
        let (done, ended) = mpsc::channel::<()>();
        let stop = &stop;
        let watch = move || {
            while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if cancel.load(Ordering::Relaxed) {
                    stop();
                    // Only the end of the work is left to wait for.
                    let _ = ended.recv();
                    return;
                }
            }
        };
        // Without a thread the work cannot be stopped, and is done all the same.
        let watcher = std::thread::Builder::new().name("net-watch".into()).spawn_scoped(scope, watch);
        let result = work();
        drop(done);
        drop(watcher);
        result
    })
}

fn one_line(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(600) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::LibraryChoice;

    #[test]
    fn floats_are_read_where_they_lie() {
        // Values are made by the library, so it must be loaded.
        Runtime::load(&LibraryChoice::default()).unwrap();
        let data = [1.0, 2.0, 3.0, 4.0];
        let value = input(&Feed::InPlace { shape: &[1, 4], data: &data }).unwrap();
        let (shape, seen) = value.try_extract_tensor::<f32>().unwrap();
        assert_eq!((&shape[..], seen.as_ptr()), (&[1, 4][..], data.as_ptr()));
    }

    #[test]
    fn a_watcher_stops_work_once_and_ends_with_it() {
        let cancel = AtomicBool::new(false);
        let stops = std::sync::atomic::AtomicUsize::new(0);
        let stop = || {
            stops.fetch_add(1, Ordering::Relaxed);
        };
        assert_eq!(watched(&cancel, stop, || 7), 7);
        watched(&cancel, stop, || {
            cancel.store(true, Ordering::Relaxed);
            std::thread::sleep(5 * LOOK);
        });
        assert_eq!(stops.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn long_texts_are_one_line_and_cut() {
        assert_eq!(one_line("a\n b\t c"), "a b c");
        assert_eq!(one_line(&"é".repeat(700)).chars().count(), 601);
    }
}

//! Finds the ONNX Runtime library, makes sure that it is one, and loads it once. Knows no model.

mod elf;

use std::ffi::CStr;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use libloading::{Library, Symbol};
use ort::execution_providers::ExecutionProvider;
use ort::sys::{ORT_API_VERSION, OrtApiBase};

use crate::error::NetError;

/// What runs networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Provider {
    /// The processor.
    #[default]
    Cpu,
    /// An NVIDIA card.
    Cuda,
}

/// Which library, on what.
#[derive(Debug, Clone, Default)]
pub struct LibraryChoice {
    /// The library itself; without it the usual places are searched.
    pub path: Option<PathBuf>,
    /// What runs networks.
    pub provider: Provider,
    /// Threads of one network; all cores without it.
    pub threads: Option<usize>,
}

/// A loaded ONNX Runtime.
#[derive(Debug, Clone)]
pub struct Runtime {
    path: PathBuf,
    version: String,
    pub(crate) provider: Provider,
    pub(crate) threads: Option<usize>,
}

/// The library of this process; there can be only one.
static LOADED: Mutex<Option<(PathBuf, String)>> = Mutex::new(None);

impl Runtime {
    /// Loads the library, or finds it loaded.
    ///
    /// # Errors
    /// No library, one that cannot be used, a second one in this process, a provider that is not there.
    pub fn load(choice: &LibraryChoice) -> Result<Self, NetError> {
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let (path, version) = match (&*loaded, find(choice)) {
            // The place it was loaded from may be gone, and does not matter unless it is named.
            (Some(known), Err(NetError::LibraryMissing { .. })) if choice.path.is_none() => known.clone(),
            (_, Err(error)) => return Err(error),
            (Some(known), Ok(path)) if known.0 == path => known.clone(),
            (Some(known), Ok(asked)) => return Err(NetError::SecondLibrary { loaded: known.0.clone(), asked }),
            (None, Ok(path)) => {
                let version = verify(&path)?;
                let failed = |why: String| NetError::Library { path: path.clone(), why };
                let environment = ort::init_from(&path).map_err(|e| failed(e.to_string()))?;
                environment.with_name("physvideo").with_telemetry(false).commit();
                let environment = ort::environment::Environment::current();
                let environment = environment.map_err(|e| failed(e.to_string()))?;
                environment.set_log_level(ort::logging::LogLevel::Error);
                loaded.insert((path, version)).clone()
            }
        };
        let runtime = Self { path, version, provider: choice.provider, threads: choice.threads };
        runtime.provider_is_there()?;
        Ok(runtime)
    }

    /// Where the library is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its version, such as 1.32.0.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// What runs networks.
    pub fn provider(&self) -> Provider {
        self.provider
    }

    fn provider_is_there(&self) -> Result<(), NetError> {
        if self.provider == Provider::Cpu {
            return Ok(());
        }
        match ort::ep::CUDA::default().is_available() {
            Ok(true) => Ok(()),
            other => Err(NetError::Provider {
                provider: "CUDA",
                path: self.path.clone(),
                why: match other {
                    Err(e) => e.to_string(),
                    _ => "it was built without CUDA; take the library of the Python package onnxruntime-gpu".into(),
                },
            }),
        }
    }
}

/// File name of the library on this system.
fn file_name() -> String {
    format!("{}onnxruntime{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX)
}

/// The library to load: a real path, or the bare name when the system's loader knows it.
fn find(choice: &LibraryChoice) -> Result<PathBuf, NetError> {
    if let Some(path) = &choice.path {
        return named(path, "--ort-lib");
    }
    if let Some(path) = std::env::var_os("ORT_DYLIB_PATH").filter(|p| !p.is_empty()) {
        return named(Path::new(&path), "ORT_DYLIB_PATH");
    }
    let name = file_name();
    let folder = std::env::current_exe().ok().and_then(|exe| exe.parent().map(Path::to_path_buf));
    // The last is for tests, whose programs lie one folder deeper.
    let near = ["", "../onnxruntime", "../lib", "../../onnxruntime"];
    let near: Vec<_> = folder.iter().flat_map(|f| near.map(|n| f.join(n).join(&name))).collect();
    if let Some(path) = near.iter().find(|p| p.is_file()) {
        return named(path, "the program's folder");
    }
    // SAFETY: loading runs the library's initialisers; it is the system's library of this name.
    if let Ok(library) = unsafe { Library::new(&name) } {
        std::mem::forget(library);
        return Ok(PathBuf::from(name));
    }
    let places: Vec<_> = near.iter().take(3).map(|p| p.display().to_string()).collect();
    Err(NetError::LibraryMissing { tried: format!("{} and {name} of the system", places.join(", ")) })
}

fn named(path: &Path, by: &str) -> Result<PathBuf, NetError> {
    std::fs::canonicalize(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => NetError::LibraryMissing { tried: format!("{} ({by})", path.display()) },
        _ => NetError::Library { path: path.to_path_buf(), why: e.to_string() },
    })
}

/// Makes sure that a file is an ONNX Runtime that is new enough, and gives its version. `ort` itself panics or aborts
/// where it is not.
fn verify(path: &Path) -> Result<String, NetError> {
    let refuse = |why: String| NetError::Library { path: path.to_path_buf(), why };
    // A bare name was found by the system's loader, which has looked at it.
    if path.is_absolute() {
        elf::check(path).map_err(refuse)?;
    }
    // SAFETY: loading runs the library's initialisers, as loading it for use would.
    let library = unsafe { Library::new(path) }.map_err(|e| refuse(format!("it cannot be loaded: {e}")))?;
    // SAFETY: the type is that of the symbol in every release of ONNX Runtime.
    let base: Symbol<unsafe extern "C" fn() -> *const OrtApiBase> =
        unsafe { library.get(b"OrtGetApiBase\0") }.map_err(|_| refuse("it is another library".into()))?;
    // SAFETY: as above; what it points to lives as long as the library.
    let Some(base) = (unsafe { base().as_ref() }) else { return Err(refuse("it offers no API".into())) };
    // SAFETY: a function of the API base, whose text is static and ends with NUL.
    let version = unsafe { (base.GetVersionString)() };
    if version.is_null() {
        return Err(refuse("it has no version".into()));
    }
    // SAFETY: see above.
    let version = unsafe { CStr::from_ptr(version) }.to_string_lossy().into_owned();
    let numbers: Vec<u32> = version.split('.').map_while(|n| n.parse().ok()).collect();
    let new_enough = matches!(numbers[..], [1, minor, ..] if minor >= ORT_API_VERSION);
    // SAFETY: a function of the API base; it answers null for versions it does not have.
    if !new_enough || unsafe { (base.GetApi)(ORT_API_VERSION) }.is_null() {
        return Err(refuse(format!("its version is {version}, and 1.{ORT_API_VERSION} or a later 1.x is needed")));
    }
    // It stays: `ort` loads it next.
    std::mem::forget(library);
    Ok(version)
}

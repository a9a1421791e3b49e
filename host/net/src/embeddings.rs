//! Arrays made elsewhere, such as the embedding of a prompt. Does not know which network reads them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Cursor;
use std::path::Path;

use crate::array::Plain;
use crate::error::NetError;
use crate::files::Folder;
use crate::npy::{read_npy, read_npz};
use crate::tensor::Tensor;

/// Most bytes of numbers in one file.
const LARGEST: u64 = 1 << 28;

/// Named arrays, each with the batch axis already.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Embeddings(BTreeMap<String, Plain>);

impl Embeddings {
    /// Reads an NPZ file.
    ///
    /// # Errors
    /// A file that is missing, damaged, larger than 256 MiB, or of another kind.
    pub fn read(path: &Path) -> Result<Self, NetError> {
        let told = |why: String| NetError::Arrays { path: path.to_path_buf(), why };
        let file = File::open(path).map_err(|e| told(e.to_string()))?;
        if !file.metadata().is_ok_and(|m| m.is_file()) {
            return Err(told("is not a file".into()));
        }
        read_npz(file, LARGEST).map(Self).map_err(told)
    }

    /// Reads an NPZ file of a model.
    pub(crate) fn of_model(folder: &Folder, name: &str) -> Result<Self, NetError> {
        let mut file = folder.open(name)?;
        let bytes = file.read(LARGEST)?;
        let told = |why: String| NetError::File { path: file.path.clone(), why };
        read_npz(Cursor::new(bytes), LARGEST).map(Self).map_err(told)
    }

    /// Puts an array in.
    pub fn insert(&mut self, key: &str, tensor: &Tensor) {
        let data = tensor.data.iter().map(|&v| f64::from(v)).collect();
        self.0.insert(key.to_owned(), Plain { shape: tensor.shape.clone(), data });
    }

    /// Names of the arrays.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    pub(crate) fn get(&self, key: &str) -> Option<&Plain> {
        self.0.get(key)
    }
}

/// Reads an NPY file of a model.
pub(crate) fn constant_of_model(folder: &Folder, name: &str) -> Result<Plain, NetError> {
    let mut file = folder.open(name)?;
    let bytes = file.read(LARGEST)?;
    let told = |why: String| NetError::File { path: file.path.clone(), why };
    read_npy(Cursor::new(bytes), LARGEST).map(|(array, _)| array).map_err(told)
}

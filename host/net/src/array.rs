//! Numbers as graphs have them: any shape, any of the types that cross the border. Knows no role.

use half::{bf16, f16};

use crate::manifest::Dtype;

/// Numbers read from a file, before it is known what type a graph wants.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plain {
    pub shape: Vec<usize>,
    pub data: Vec<f64>,
}

/// Numbers of one type.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Numbers {
    F32(Vec<f32>),
    F16(Vec<f16>),
    Bf16(Vec<bf16>),
    I64(Vec<i64>),
    I32(Vec<i32>),
    Bool(Vec<bool>),
}

/// A tensor of a graph.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Array {
    pub shape: Vec<usize>,
    pub numbers: Numbers,
}

impl Array {
    /// From canonical numbers: floats to nearest even, integers truncated towards zero, truth is what is not 0.
    pub fn from_f32(shape: Vec<usize>, data: &[f32], dtype: Dtype) -> Self {
        let numbers = match dtype {
            Dtype::F32 => Numbers::F32(data.to_vec()),
            other => convert(data.iter().map(|&v| f64::from(v)), other),
        };
        Self { shape, numbers }
    }

    /// The same from numbers of double width.
    pub fn from_f64(shape: Vec<usize>, data: &[f64], dtype: Dtype) -> Self {
        Self { shape, numbers: convert(data.iter().copied(), dtype) }
    }
}

fn convert(data: impl Iterator<Item = f64>, dtype: Dtype) -> Numbers {
    match dtype {
        Dtype::F32 => Numbers::F32(data.map(|v| v as f32).collect()),
        Dtype::F16 => Numbers::F16(data.map(f16::from_f64).collect()),
        Dtype::Bf16 => Numbers::Bf16(data.map(bf16::from_f64).collect()),
        Dtype::I64 => Numbers::I64(data.map(|v| v as i64).collect()),
        Dtype::I32 => Numbers::I32(data.map(|v| v as i32).collect()),
        Dtype::Bool => Numbers::Bool(data.map(|v| v != 0.0).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_converted_at_the_border() {
        let data = [999.9, -999.9, 0.0, 0.3];
        let of = |dtype| Array::from_f64(vec![4], &data, dtype).numbers;
        assert_eq!(of(Dtype::I64), Numbers::I64(vec![999, -999, 0, 0]));
        assert_eq!(of(Dtype::I32), Numbers::I32(vec![999, -999, 0, 0]));
        assert_eq!(of(Dtype::Bool), Numbers::Bool(vec![true, true, false, true]));
        assert_eq!(of(Dtype::F16), Numbers::F16(data.map(f16::from_f64).to_vec()));
        // 1 + 2^-9 lies between two bfloat16 and goes to the even one.
        let half_way = Array::from_f32(vec![1], &[1.0 + 1.0 / 256.0], Dtype::Bf16).numbers;
        assert_eq!(half_way, Numbers::Bf16(vec![bf16::from_f32(1.0)]));
    }
}

//! Pipelines: compiled only when needed, cached, reloaded from a folder.

use physvideo_gpu::kernels::{self, Grid, cells};
use physvideo_gpu::{Constants, Gpu, GpuError, Groups, Options, Recording};
use physvideo_tests::{device, folder};

/// What `cells/clear` leaves of counts that were all 3.
fn cleared(gpu: &Gpu) -> Result<Vec<u32>, GpuError> {
    let counts = gpu.upload("run", "counts", &[3u32; 64])?;
    let (list, table) = (gpu.alloc("run", "list", 1)?, gpu.alloc("run", "table", 1)?);
    let immediates = Grid { capacity: 1, blocks: [1; 3], dx: 1.0, ..Default::default() };
    let mut rec = Recording::new("clear");
    rec.call(&cells::Clear { list, table, counts, immediates }, &Constants::none(), Groups::Direct([1, 1, 1]));
    gpu.run(&rec)?;
    gpu.read(counts)
}

#[test]
fn only_what_ran_is_compiled() {
    let gpu = device::gpu();
    assert_eq!(gpu.compiled(), Vec::<&str>::new());
    assert_eq!(cleared(&gpu).unwrap(), [0; 64]);
    assert_eq!(cleared(&gpu).unwrap(), [0; 64]);
    assert_eq!(gpu.compiled(), ["cells/clear"]);
}

#[test]
fn variants_are_compiled_once_each_and_foreign_constants_make_none() {
    let gpu = device::gpu();
    let kernel = kernels::find("mpm/p2g").unwrap();
    let sizes: Vec<_> =
        kernel.bindings.iter().map(|b| gpu.alloc::<u8>("run", b.name, b.bytes.into()).unwrap()).collect();
    let run = |constants: Constants| {
        let mut rec = Recording::new("variant");
        let bufs = sizes.iter().map(|b| b.erase()).collect();
        let groups = Groups::Direct([0, 1, 1]);
        rec.commands.push(physvideo_gpu::Command::Call { kernel, constants, bufs, immediates: vec![], groups });
        gpu.run(&rec).unwrap();
    };
    run(Constants::none());
    run(Constants::none().with("TRUE_GRADIENT", 0.0));
    run(Constants::none().with("TRUE_GRADIENT", 1.0).with("TRUE_GRADIENT", 0.0));
    run(Constants::none().with("NOT_MINE", 4.0).with("TRUE_GRADIENT", 0.0));
    assert_eq!(gpu.compiled(), ["mpm/p2g", "mpm/p2g"]);
}

#[test]
fn the_pipeline_cache_goes_round_and_rubbish_does_no_harm() {
    let first = device::gpu();
    cleared(&first).unwrap();
    let bytes = first.pipeline_cache().unwrap();
    // The header of a pipeline cache alone has 32 bytes.
    assert!(bytes.len() >= 32, "{} bytes", bytes.len());
    drop(first);
    for cache in [bytes.clone(), bytes[..20].to_vec(), vec![0xa5; 100]] {
        let gpu = device::open(Options { pipeline_cache: cache.clone(), ..device::options() });
        assert_eq!(cleared(&gpu).unwrap(), [0; 64]);
        if cache == bytes {
            assert_eq!(gpu.messages(), Vec::<String>::new());
        }
    }
}

#[test]
fn kernels_are_read_anew_from_a_folder() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    let open = || device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    assert_eq!(cleared(&open()).unwrap(), [0; 64]);
    folder::edit(copy.path(), "cells/clear", "+ lane] = 0u", "+ lane] = 7u");
    assert_eq!(cleared(&open()).unwrap(), [7; 64]);
    // An import as well.
    folder::edit(copy.path(), "lib/grid", "const EMPTY: u32 = 0u;", "const EMPTY: u32 = true;");
    assert!(cleared(&open()).is_err());
}

#[test]
fn a_broken_kernel_is_shown_with_file_line_and_caret() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "cells/clear", "counts.d[group.x", "numbers.d[group.x");
    let gpu = device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    let error = cleared(&gpu).unwrap_err();
    let said = error.to_string();
    assert!(matches!(error, GpuError::Compile { .. }), "{said}");
    let text = std::fs::read_to_string(copy.path().join("cells/clear.wgsl")).unwrap();
    let line = text.lines().position(|l| l.contains("numbers")).unwrap() + 1;
    assert!(said.contains("no definition in scope for identifier: `numbers`"), "{said}");
    assert!(said.contains(&format!("cells/clear:{line}:5")) && said.contains("^^^^^^^"), "{said}");
    std::fs::remove_file(copy.path().join("lib/grid.wgsl")).unwrap();
    let said = cleared(&device::open(Options { wgsl: Some(copy.path().into()), ..device::options() }))
        .unwrap_err()
        .to_string();
    assert!(said.contains("cannot import") && said.contains("lib/grid.wgsl"), "{said}");
}

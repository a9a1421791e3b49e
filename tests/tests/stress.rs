//! Cases that must not explode: those of `physvideo_tests::stress` that are small, each with one material here and with
//! all of its materials in `physvideo-bench stress`.

use physvideo_tests::device::gpu;
use physvideo_tests::stress;

/// Each case takes the next of its materials, so that all of them come by.
#[test]
fn nothing_explodes() {
    let gpu = gpu();
    let mut wrong = Vec::new();
    for (i, case) in stress::all().into_iter().filter(|c| !c.large).enumerate() {
        for method in case.solvers {
            let materials = case.materials_of(method);
            let material = materials[i % materials.len()];
            match stress::run(&gpu, case, material, method) {
                Ok(row) => println!("{}, {material}, {method}: {}, {:?}", case.name, row.verdict.word(), row.counts),
                Err(e) => wrong.push(e),
            }
        }
    }
    assert!(gpu.messages().is_empty(), "{:?}", gpu.messages());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn cases_have_names_and_materials() {
    let mut names: Vec<_> = stress::all().iter().map(|c| c.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), stress::all().len(), "names are unique");
    for case in stress::all() {
        assert!(
            case.solvers.iter().all(|s| !case.expected(s).is_empty() && !case.materials_of(s).is_empty())
                && case.materials.iter().all(|m| stress::MATERIALS.contains(m)),
            "{}",
            case.name
        );
    }
}

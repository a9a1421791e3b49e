//! The table behind `--error-budget`, on a beam that it was not measured on: another slenderness, load and material.

use physvideo::accuracy::{elastic, fit};
use physvideo_tests::device::gpu;
use physvideo_tests::problems::cantilever::{Beam, sag, square};

use super::at;

const UNSEEN: Beam = Beam { slender: 7.0, neo_hookean: true };
const LOAD: f64 = 2.0;

#[test]
fn a_budget_is_kept_on_an_unseen_beam() {
    let gpu = gpu();
    for budget in [0.1, 0.03] {
        // A coarse beam shows how thick it is; what is chosen says how many cells its thickness needs.
        let thick = 4;
        let chosen = fit(&square(UNSEEN, thick), budget).unwrap().unwrap();
        let cells = (f64::from(thick) * f64::from(chosen.grid_density)).round() as u32;
        assert_eq!(cells, chosen.row.cells as u32, "{chosen:?}");
        let (tip, _) = sag(&gpu, at(cells, chosen.row.courant), UNSEEN, LOAD).unwrap();
        let error = (tip / UNSEEN.exact(LOAD) - 1.0).abs();
        println!("budget {budget}: {chosen:?}, error {error:.4}");
        // The table's figure within a factor of two.
        let predicted = f64::from(chosen.row.error);
        assert!(
            error < 2.0 * predicted && error > 0.5 * predicted && predicted <= f64::from(budget),
            "{error} {chosen:?}"
        );
    }
    // Control: a beam of half the cells is not within the finer budget.
    let coarse = elastic().iter().map(|r| r.cells).fold(f32::MAX, f32::min) as u32;
    let (tip, _) = sag(&gpu, at(coarse, 0.75), UNSEEN, LOAD).unwrap();
    assert!((tip / UNSEEN.exact(LOAD) - 1.0).abs() > 0.03);
}

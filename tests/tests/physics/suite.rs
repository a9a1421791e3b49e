//! The list of problems is fit to be swept.

use physvideo_tests::problems;

#[test]
fn every_problem_can_be_swept() {
    let all = problems::all();
    let mut ids: Vec<_> = all.iter().map(|p| p.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), all.len(), "ids are unique");
    for p in all {
        assert!(p.resolutions.len() >= 4 && p.resolutions.is_sorted_by(|a, b| a < b), "{}", p.id);
        assert!(p.courants.len() >= 3 && p.courants.is_sorted_by(|a, b| a < b), "{}", p.id);
        assert!(!p.methods.is_empty() && p.goal > 0.0, "{}", p.id);
    }
}

#[test]
fn the_order_is_the_slope() {
    let errors = [4.0, 8.0, 16.0f64].map(|n| (n, 3.0 * n.powf(-2.5)));
    assert!((problems::order(&errors) - 2.5).abs() < 1e-12);
}

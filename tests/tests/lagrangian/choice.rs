//! Which worlds qualify, and what is said of those that do not.

use physvideo::elastic::choose;
use physvideo::scene::Elastic;
use physvideo::stages::lagrangian::{Unfit, fit, thin};

use super::setup::{body, fill, world};

const DX: f64 = 1.0 / 16.0;

#[test]
fn bodies_on_a_lattice_qualify() {
    let cube = || body((1e5, 0.3), 1000.0, DX, fill(DX, [0.1; 3], [0.6; 3], |_| true), |_| [0.0; 3]);
    let mut good = world(vec![cube()], DX);
    let loose = choose(Elastic::Auto, &good).unwrap();
    assert!(!loose.total_lagrangian && loose.why.contains("nothing holds"), "{loose:?}");
    good.bodies[0].pinned = good.bodies[0].positions.iter().map(|x| x[2] < 0.2).collect();
    assert_eq!((fit(&good), thin(&good)), (Ok(()), None));
    assert!(choose(Elastic::Auto, &good).unwrap().total_lagrangian);
    assert!(!choose(Elastic::UpdatedLagrangian, &good).unwrap().total_lagrangian);
    let ball = fill(DX, [-0.5; 3], [0.5; 3], |x| x.iter().map(|c| c * c).sum::<f64>() < 0.25);
    assert_eq!(thin(&world(vec![body((1e5, 0.3), 1000.0, DX, ball, |_| [0.0; 3])], DX)), None);

    // One particle off its place; two at one place; other spacings; none; two bodies; a sheet.
    let mut off = world(vec![cube()], DX);
    off.bodies[0].positions[7][1] += 0.1 * DX as f32;
    assert_eq!(fit(&off), Err((0, Unfit::Irregular)));
    let mut twice = world(vec![cube()], DX);
    twice.bodies[0].positions[7] = twice.bodies[0].positions[8];
    assert_eq!(fit(&twice), Err((0, Unfit::Irregular)));
    assert_eq!(fit(&world(vec![cube()], 0.8 * DX)), Err((0, Unfit::Spacing)));
    let mut none = world(vec![cube()], DX);
    none.bodies[0].positions.clear();
    assert_eq!(fit(&none), Err((0, Unfit::Empty)));
    let mut two = world(vec![cube(), cube()], DX);
    let sheet = fill(DX, [0.0; 3], [0.5, 0.5, DX / 2.0], |_| true);
    let sheet = world(vec![body((1e5, 0.3), 1000.0, DX, sheet, |_| [0.0; 3])], DX);
    assert_eq!(thin(&sheet), Some(0));
    for (bad, why) in [(&off, "no regular lattice"), (&two, "nothing holds"), (&sheet, "less than two particles thick")]
    {
        let choice = choose(Elastic::Auto, bad).unwrap();
        assert!(!choice.total_lagrangian && choice.why.contains(why), "{choice:?}");
    }
    // Asked for, a sheet is taken at its word; what cannot be done is refused with the place of the key.
    assert!(choose(Elastic::TotalLagrangian, &sheet).unwrap().total_lagrangian);
    assert!(choose(Elastic::TotalLagrangian, &two).unwrap().total_lagrangian);
    two.bodies.iter_mut().for_each(|b| b.pinned = good.bodies[0].pinned.clone());
    let both = choose(Elastic::Auto, &two).unwrap();
    assert!(both.total_lagrangian && both.why.starts_with("2 elastic bodies"), "{both:?}");
    let refused = choose(Elastic::TotalLagrangian, &off).unwrap_err();
    assert!(format!("{refused:?}").contains("simulation.elastic"), "{refused:?}");
}

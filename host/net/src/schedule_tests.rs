use super::*;

const GRID: Grid = Grid { frames: 9, height: 32, width: 32 };

fn schedule(kind: ScheduleKind, steps: usize, terminal: Option<f64>) -> Schedule {
    Schedule::new(&ScheduleSpec { kind, steps, terminal }, GRID).unwrap()
}

fn sigma(schedule: &Schedule, step: usize) -> f64 {
    schedule.sigma(StepIndex(step)).value()
}

fn framepack() -> ScheduleKind {
    ScheduleKind::ByTokens { base: 0.5, slope: 0.65, from: 256.0, span: 3840.0, most: Some(7.0), patch: [1, 2, 2] }
}

fn cogvideox() -> ScheduleKind {
    ScheduleKind::Vp {
        train_steps: 1000,
        beta_start: 0.00085,
        beta_end: 0.012,
        snr_shift: 1.0,
        zero_terminal_snr: true,
    }
}

#[test]
fn shift_7_gives_the_papers_numbers() {
    let s = schedule(ScheduleKind::Shift { shift: 7.0 }, 25, None);
    assert!((sigma(&s, 20) - 28.0 / 29.0).abs() < 1e-15);
    assert!((sigma(&s, 1) - 7.0 / 31.0).abs() < 1e-15);
    assert_eq!((sigma(&s, 0), sigma(&s, 25), sigma(&s, 26), s.steps()), (0.0, 1.0, 1.0, 25));
}

#[test]
fn the_shift_of_framepack_follows_the_tokens() {
    let s = schedule(framepack(), 25, None);
    assert!((sigma(&s, 20) - 0.90317).abs() < 5e-6, "{}", sigma(&s, 20));
    let shift = (0.5_f64 + 0.65 * (2304.0 - 256.0) / 3840.0).exp();
    assert!((shift - 2.33186).abs() < 5e-6);
    // From 8,798 tokens on it is 7.
    let wide = Schedule::new(
        &ScheduleSpec { kind: framepack(), steps: 25, terminal: None },
        Grid { frames: 9, height: 80, width: 80 },
    );
    assert!((sigma(&wide.unwrap(), 20) - 28.0 / 29.0).abs() < 1e-12);
}

#[test]
fn a_terminal_is_the_noise_of_step_1() {
    let s = schedule(ScheduleKind::Shift { shift: 2.0 }, 10, Some(0.1));
    assert!((sigma(&s, 1) - 0.1).abs() < 1e-12);
    assert_eq!((sigma(&s, 0), sigma(&s, 10)), (0.0, 1.0));
    // Differences of 1 - sigma keep their ratios.
    let u = schedule(ScheduleKind::Shift { shift: 2.0 }, 10, None);
    for i in 1..10 {
        let ratio = (1.0 - sigma(&s, i)) / (1.0 - sigma(&u, i));
        assert!((ratio - 0.9 / (1.0 - sigma(&u, 1))).abs() < 1e-12);
    }
}

#[test]
fn a_vp_table_ends_in_noise_and_knows_its_entries() {
    let s = schedule(cogvideox(), 50, None);
    assert_eq!(sigma(&s, 50), 1.0);
    assert_eq!(s.timestep(s.sigma(StepIndex(50))), 999);
    assert_eq!(s.timestep(s.sigma(StepIndex(25))), 499);
    assert_eq!(s.timestep(s.sigma(StepIndex(1))), 19);
    assert_eq!(s.timestep(Sigma::new(0.0).unwrap()), 0);
    // First entry: one beta of noise.
    let first = (1.0 - 0.00085_f64).sqrt();
    let expected = 0.00085_f64.sqrt() / (first + 0.00085_f64.sqrt());
    assert!((s.table[0] - expected).abs() < 1e-9, "{} {expected}", s.table[0]);
}

#[test]
fn numbers_without_a_schedule_are_refused() {
    let new = |kind, steps, terminal| Schedule::new(&ScheduleSpec { kind, steps, terminal }, GRID);
    assert!(new(ScheduleKind::Shift { shift: 7.0 }, 0, None).is_err());
    assert!(new(ScheduleKind::Shift { shift: f64::NAN }, 5, None).is_err());
    assert!(new(cogvideox(), 1001, None).is_err());
    assert!(new(ScheduleKind::Shift { shift: 2.0 }, 5, Some(1.0)).is_err());
    for value in [-1e-9, 1.0 + 1e-9, f64::NAN, f64::INFINITY] {
        assert!(Sigma::new(value).is_err());
    }
}

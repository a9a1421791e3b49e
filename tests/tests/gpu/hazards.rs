//! Derived barriers by property: one between every two commands that conflict, and none where there is no conflict.

use physvideo_gpu::{AnyBuf, Command, Constants, Groups, Step, schedule};
use physvideo_tests::probe;
use proptest::prelude::*;

/// What a command does to each buffer it touches, as the test sees it: buffer, reads, writes.
type Access = Vec<(u32, bool, bool)>;

fn any(id: u32) -> AnyBuf {
    AnyBuf { id, bytes: 64 }
}

/// A command and what it does, from a plain description.
fn command() -> impl Strategy<Value = (Command, Access)> {
    let buffer = 0u32..5;
    let access = (buffer.clone(), 0..3u8).prop_map(|(id, kind)| (id, kind != 1, kind != 0));
    let call = (prop::collection::vec(access, 1..4), prop::option::of(buffer.clone()));
    prop_oneof![
        6 => call.prop_map(|(bound, sizes)| {
            const NAMES: [&str; 3] = ["a", "b", "c"];
            let bindings: Vec<_> = bound.iter().zip(NAMES).map(|((_, r, w), name)| (name, *r, *w)).collect();
            let groups = sizes.map_or(Groups::Direct([1, 1, 1]), |id| Groups::Indirect(any(id), 0));
            let call = Command::Call {
                kernel: probe::kernel("probe/none", 64, "", &bindings, &[]),
                constants: Constants::none(),
                bufs: bound.iter().map(|b| any(b.0)).collect(),
                immediates: vec![],
                groups,
            };
            // The size of an indirect dispatch is read.
            let all = bound.into_iter().chain(sizes.map(|id| (id, true, false))).collect();
            (call, all)
        }),
        1 => buffer.clone().prop_map(|id| (Command::Fill(any(id), 0), vec![(id, false, true)])),
        1 => (buffer.clone(), buffer).prop_map(|(a, b)| {
            (Command::Copy(any(a), any(b), 4), vec![(a, true, false), (b, false, true)])
        }),
        1 => Just((Command::Section("s".into()), vec![])),
    ]
}

/// One of them writes what the other touches.
fn conflict(a: &Access, b: &Access) -> bool {
    a.iter().any(|x| b.iter().any(|y| x.0 == y.0 && (x.2 || y.2)))
}

/// What is wrong with a schedule, if anything.
fn fault(accesses: &[Access], steps: &[Step]) -> Option<String> {
    let runs: Vec<_> = steps.iter().filter_map(|s| if let Step::Run(i) = s { Some(*i) } else { None }).collect();
    if runs != (0..accesses.len()).collect::<Vec<_>>() {
        return Some(format!("not every command once and in order: {runs:?}"));
    }
    // Stretches between barriers.
    let stretches: Vec<Vec<usize>> = steps
        .split(|s| *s == Step::Barrier)
        .map(|part| part.iter().filter_map(|s| if let Step::Run(i) = s { Some(*i) } else { None }).collect())
        .collect();
    for stretch in &stretches {
        for (n, j) in stretch.iter().enumerate() {
            if let Some(i) = stretch[..n].iter().find(|i| conflict(&accesses[**i], &accesses[*j])) {
                return Some(format!("{i} and {j} conflict and no barrier lies between them"));
            }
        }
    }
    for pair in stretches.windows(2) {
        // The command behind a barrier is why it is there.
        let needed = pair[1].first().is_some_and(|j| pair[0].iter().any(|i| conflict(&accesses[*i], &accesses[*j])));
        if !needed {
            return Some(format!("a barrier before {:?} that nothing needs", pair[1].first()));
        }
    }
    None
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_barrier_between_every_conflict_and_nowhere_else(list in prop::collection::vec(command(), 0..25)) {
        let (commands, accesses): (Vec<_>, Vec<_>) = list.into_iter().unzip();
        prop_assert_eq!(fault(&accesses, &schedule(&commands)), None);
    }

    /// Negative control: the same lists without their barriers, or with one too many, are found at fault.
    #[test]
    fn the_oracle_finds_faults(list in prop::collection::vec(command(), 2..25)) {
        let (commands, accesses): (Vec<_>, Vec<_>) = list.into_iter().unzip();
        let steps = schedule(&commands);
        let bare: Vec<_> = steps.iter().copied().filter(|s| *s != Step::Barrier).collect();
        prop_assert_eq!(fault(&accesses, &bare).is_some(), bare.len() < steps.len());
        let more: Vec<_> = [Step::Barrier].into_iter().chain(steps).collect();
        prop_assert!(fault(&accesses, &more).is_some());
    }
}

/// The layer never reports write after write between dispatches, and an indirect size is easily forgotten: by name.
#[test]
fn the_three_hazards_and_the_indirect_size() {
    let (a, b) = (any(0), any(1));
    let writer = probe::kernel("probe/none", 64, "", &[("a", false, true)], &[]);
    let reader = probe::kernel("probe/none", 64, "", &[("a", true, false)], &[]);
    let call = |kernel, buf, groups| Command::Call {
        kernel,
        constants: Constants::none(),
        bufs: vec![buf],
        immediates: vec![],
        groups,
    };
    let one = Groups::Direct([1, 1, 1]);
    let between = |first: Command, second: Command| schedule(&[first, second]).contains(&Step::Barrier);
    assert!(between(call(writer, a, one), call(reader, a, one)), "read after write");
    assert!(between(call(reader, a, one), call(writer, a, one)), "write after read");
    assert!(between(call(writer, a, one), call(writer, a, one)), "write after write");
    assert!(!between(call(reader, a, one), call(reader, a, one)), "read after read");
    assert!(between(call(writer, a, one), call(reader, b, Groups::Indirect(a, 0))), "size written, then read");
    assert!(between(call(reader, b, Groups::Indirect(a, 0)), call(writer, a, one)), "size read, then written");
}

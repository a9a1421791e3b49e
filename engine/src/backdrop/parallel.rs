//! One loop over items, spread over scoped threads. Knows nothing of images; results never depend on the thread count.

/// Sets every `out[i]` to `make(i)`, on up to `threads` threads. `make` sees nothing of `out`.
pub(super) fn fill_with<T: Send>(threads: usize, out: &mut [T], make: impl Fn(usize) -> T + Sync) {
    let run = |start: usize, part: &mut [T]| {
        for (k, o) in part.iter_mut().enumerate() {
            *o = make(start + k);
        }
    };
    // Below this a thread costs more than it saves.
    if threads <= 1 || out.len() < 512 {
        return run(0, out);
    }
    let chunk = out.len().div_ceil(threads);
    std::thread::scope(|scope| {
        for (n, part) in out.chunks_mut(chunk).enumerate() {
            let run = &run;
            scope.spawn(move || run(n * chunk, part));
        }
    });
}

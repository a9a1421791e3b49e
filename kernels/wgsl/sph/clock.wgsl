//! use lib/sph lib/tick lib/open lib/keep
// Chooses the next step, and whether it searches for neighbours or keeps the lists it has.

// Particles may start anew anywhere in any step: each searches.
override RECYCLES: bool = false;
override INCOMPRESSIBLE: bool = false;

@group(0) @binding(0) var<storage, read_write> clock: Clock;
@group(0) @binding(1) var<storage, read_write> live: Live;
@group(0) @binding(2) var<storage, read_write> keep: Keep;
var<immediate> grid: Grid;

@compute @workgroup_size(1)
fn main() {
    let opens = clock.substeps == 0u;
    let speed = bitcast<f32>(min(atomicLoad(&keep.apart), 0x7f7fffffu));
    keep.moved += clock.dt * speed;
    atomicStore(&keep.apart, 0u);
    for (var a = 0u; a < 3u; a++) {
        let low = atomicExchange(&keep.low[a], 0xffffffffu);
        let high = atomicExchange(&keep.high[a], 0u);
        keep.drift[a] = select(0.0, 0.5 * (unranked(low) + unranked(high)), low <= high);
    }
    let made = atomicLoad(&live.nodes);
    if (made > 0u) { keep.nodes = made; }
    if (opens) { keep.searches = 0u; }
    tick();
    let goes = clock.particle_groups.x > 0u;
    let spent = atomicLoad(&keep.spent) != 0u;
    if (!goes || !(RECYCLES || opens || spent || keep.moved > 0.5 * keep.skin)) {
        keep.groups = vec3u(0u, 1u, 1u);
        keep.clear = vec3u(0u, 1u, 1u);
        // Neither does the sort go over the blocks again.
        atomicStore(&live.blocks, 0u);
        atomicStore(&live.nodes, 0u);
        return;
    }
    keep.groups = clock.particle_groups;
    keep.clear = vec3u(keep.nodes, 1u, 1u);
    keep.searches += 1u;
    keep.moved = 0.0;
    atomicStore(&keep.spent, 0u);
    open_list();
    // A skin of s h holds for s/d steps, where two come nearer by d h in each: with a search that costs R and sums over
    // its lists that cost L (1 + s/2)³, a step costs least at about s = sqrt(2 R d/(3 L)). R/L is 3 for WCSPH and a
    // half for DFSPH, measured. One that would not hold for two steps is left out, and one that was too crowded.
    let way = 2.0 * clock.dt * speed / h_of();
    let skin = min(sqrt(select(2.0, 0.35, INCOMPRESSIBLE) * way), CELL - 2.0);
    keep.skin = select(h_of() * skin, 0.0, RECYCLES || spent || skin < 2.0 * way);
}

// What a compliant surface gives way. Pressure over stiffness [m] for a depth [m] begins without a slope, as d²/(2 w) up to
// w = `soft`, and goes on as d − w/2; a part with the fifth power, d⁵/`firm`⁴, holds what is pressed hard. With a kink at
// its start each touch within a step is an error of energy of either sign, and those add up: at Courant number 0.75 a block of
// eight cells that bounced thirty times gained a third. Wider ones leave less of it, and are too soft for what rests.

fn give(depth: vec3f, soft: f32, firm: f32) -> vec3f {
    let q = depth / firm;
    return select(depth - 0.5 * soft, 0.5 / soft * depth * depth, depth < vec3f(soft)) + q * q * q * q * depth;
}

// Its integral: energy over stiffness and area [m²].
fn stored(depth: vec3f, soft: f32, firm: f32) -> vec3f {
    let q = depth / firm;
    let over = depth - 0.5 * soft;
    let begun = select(0.5 * over * over + soft * soft / 24.0, depth * depth * depth / (6.0 * soft), depth < vec3f(soft));
    return begun + q * q * q * q * depth * depth / 6.0;
}

// By how much more it pushes the faster it is pressed, and less the faster it lets go (Hunt & Crossley 1975), for a closing
// speed and that of waves. It takes some thousandths a bounce, more than what is left of those errors makes.
const LOSS: f32 = 0.3;

fn rebound(closing: f32, wave: f32) -> f32 {
    return 1.0 + LOSS * clamp(closing / wave, -1.0, 1.0);
}

//! Materials of bodies as plain data, with the paper's defaults, and what the kernels get of them. Knows nothing of
//! solvers.

use physvideo_gpu::kernels::family::material;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Material of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Material {
    /// Fixed-corotated elasticity (Stomakhin 2012).
    Elastic {
        /// Young's modulus [Pa].
        #[serde(default = "young")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "poisson")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 0.5))]
        poisson: f32,
    },
    /// Compressible neo-Hookean elasticity.
    NeoHookean {
        /// Young's modulus [Pa].
        #[serde(default = "young")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "poisson")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 0.5))]
        poisson: f32,
    },
    /// Clay, dough, ice cream: elastic until it yields, then it keeps its new shape (von Mises; Simo 1992).
    Plastic {
        /// Young's modulus [Pa].
        #[serde(default = "young")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "poisson")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 0.5))]
        poisson: f32,
        /// Stress at which it yields [Pa].
        #[serde(default = "yield_stress")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        yield_stress: f32,
        /// How much the yield stress grows with each unit of plastic strain [Pa].
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        hardening: f32,
    },
    /// Snow (Stomakhin 2013): packs and hardens under pressure, breaks when stretched.
    Snow {
        /// Young's modulus of fresh snow [Pa] (Stomakhin: 1.4e5).
        #[serde(default = "snow_young")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5 (Stomakhin: 0.2).
        #[serde(default = "snow_poisson")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 0.5))]
        poisson: f32,
        /// Compression it stands before it packs, θc.
        #[serde(default = "critical_compression")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
        critical_compression: f32,
        /// Stretch it stands before it breaks, θs.
        #[serde(default = "critical_stretch")]
        #[schemars(range(min = 0.0))]
        critical_stretch: f32,
        /// How fast it hardens as it packs, ξ; it hardens by exp(0.4 ξ) at the most.
        #[serde(default = "snow_hardening")]
        #[schemars(range(min = 0.0, max = 20.0))]
        hardening: f32,
    },
    /// Foam and bubbles: snow with the paper's parameters (E 8e4, ν 0.32).
    Foam {
        /// Young's modulus [Pa].
        #[serde(default = "young")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "poisson")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 0.5))]
        poisson: f32,
    },
    /// Dry sand (Klár 2016): Drucker–Prager with volume correction.
    Sand {
        /// Young's modulus [Pa].
        #[serde(default = "sand_young")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "sand_poisson")]
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 0.5))]
        poisson: f32,
        /// Coefficient of internal friction, the tangent of the angle of repose.
        #[serde(default = "sand_friction")]
        #[schemars(range(min = 0.0))]
        friction: f32,
    },
    /// Liquid of the grid: nearly incompressible, viscous or not.
    Liquid {
        /// Bulk modulus K [Pa]: softer than real ones, so that steps are longer; the speed of sound is √(K/ρ).
        #[serde(default = "bulk")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        bulk: f32,
        /// Exponent of the equation of state (water: 7).
        #[serde(default = "exponent")]
        #[schemars(extend("exclusiveMinimum" = 1.0), range(max = 10.0))]
        exponent: f32,
        /// Dynamic viscosity [Pa s] (water 1e-3, honey 5).
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        viscosity: f32,
    },
    /// Liquid of SPH, without a grid. A scene has none or only such.
    Sph {
        /// Kinematic viscosity [m²/s] (paper: 5e-3).
        #[serde(default = "kinematic")]
        #[schemars(range(min = 0.0))]
        viscosity: f32,
        /// Surface tension [N/m] (water 0.072); its steps grow shorter with the particles' size^1.5.
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        surface_tension: f32,
    },
}

/// A material as the kernels know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Number among the kernels' materials.
    pub material: u32,
    /// Shear modulus [Pa].
    pub mu: f32,
    /// Lamé's first parameter, or the bulk modulus of a liquid [Pa].
    pub lambda: f32,
    /// Parameters of the material's own, as its WGSL names them.
    pub own: [f32; 4],
    /// Dynamic viscosity [Pa s].
    pub viscosity: f32,
}

/// J_p below which snow hardens no more.
const LEAST_PACKED: f32 = 0.6;

impl Material {
    /// What the kernels get.
    pub fn law(&self) -> Law {
        let solid = |material, young, poisson, own| {
            let (mu, lambda) = lame(young, poisson);
            Law { material, mu, lambda, own, viscosity: 0.0 }
        };
        match *self {
            Material::Elastic { young, poisson } => solid(material::COROTATED, young, poisson, [0.0; 4]),
            Material::NeoHookean { young, poisson } => solid(material::NEO_HOOKEAN, young, poisson, [0.0; 4]),
            Material::Plastic { young, poisson, yield_stress, hardening } => {
                solid(material::PLASTIC, young, poisson, [yield_stress, hardening, 0.0, 0.0])
            }
            Material::Snow { young, poisson, critical_compression, critical_stretch, hardening } => {
                let own = [critical_compression, critical_stretch, hardening, LEAST_PACKED];
                solid(material::SNOW, young, poisson, own)
            }
            Material::Foam { young, poisson } => {
                let own = [critical_compression(), critical_stretch(), snow_hardening(), LEAST_PACKED];
                solid(material::SNOW, young, poisson, own)
            }
            Material::Sand { young, poisson, friction } => {
                // α = √(2/3) 2 sin φ / (3 − sin φ) with tan φ = friction (Klár 2016).
                let tan = f64::from(friction);
                let sin = tan / tan.hypot(1.0);
                let alpha = (2.0_f64 / 3.0).sqrt() * 2.0 * sin / (3.0 - sin);
                solid(material::SAND, young, poisson, [alpha as f32, 0.0, 0.0, 0.0])
            }
            Material::Liquid { bulk, exponent, viscosity } => Law {
                material: material::LIQUID,
                mu: 0.0,
                lambda: bulk,
                own: [exponent, viscosity, 0.0, 0.0],
                viscosity,
            },
            // Its solver asks for nothing but the viscosity [m²/s] and the tension [N/m].
            Material::Sph { viscosity, surface_tension } => {
                let own = [surface_tension, 0.0, 0.0, 0.0];
                Law { material: 0, mu: viscosity, lambda: 0.0, own, viscosity: 0.0 }
            }
        }
    }

    /// Word for it in a scene file.
    pub fn name(&self) -> &'static str {
        match self {
            Material::Elastic { .. } => "elastic",
            Material::NeoHookean { .. } => "neo_hookean",
            Material::Plastic { .. } => "plastic",
            Material::Snow { .. } => "snow",
            Material::Foam { .. } => "foam",
            Material::Sand { .. } => "sand",
            Material::Liquid { .. } => "liquid",
            Material::Sph { .. } => "sph",
        }
    }

    /// How many times as stiff as at rest it can become by packing.
    pub fn hardest(&self) -> f32 {
        match *self {
            Material::Snow { hardening, .. } => (hardening * (1.0 - LEAST_PACKED)).exp(),
            Material::Foam { .. } => (snow_hardening() * (1.0 - LEAST_PACKED)).exp(),
            _ => 1.0,
        }
    }

    /// Young's modulus of what keeps its shape [Pa].
    pub fn young(&self) -> Option<f32> {
        match *self {
            Material::Elastic { young, .. } | Material::NeoHookean { young, .. } => Some(young),
            _ => None,
        }
    }

    /// The same with another Young's modulus [Pa], where it keeps its shape.
    pub fn with_young(self, young: f32) -> Self {
        match self {
            Material::Elastic { poisson, .. } => Material::Elastic { young, poisson },
            Material::NeoHookean { poisson, .. } => Material::NeoHookean { young, poisson },
            other => other,
        }
    }

    /// Keeps its shape: its deformation gradient says how it has moved since the start.
    pub fn elastic(&self) -> bool {
        matches!(self, Material::Elastic { .. } | Material::NeoHookean { .. })
    }
}

/// Lamé parameters [Pa] from Young's modulus and Poisson's ratio.
pub fn lame(young: f32, poisson: f32) -> (f32, f32) {
    let (e, nu) = (f64::from(young), f64::from(poisson));
    ((e / (2.0 * (1.0 + nu))) as f32, (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))) as f32)
}

fn young() -> f32 {
    8e4
}
fn poisson() -> f32 {
    0.32
}
fn yield_stress() -> f32 {
    2e3
}
fn snow_young() -> f32 {
    1.4e5
}
fn snow_poisson() -> f32 {
    0.2
}
fn critical_compression() -> f32 {
    2.5e-2
}
fn critical_stretch() -> f32 {
    7.5e-3
}
fn snow_hardening() -> f32 {
    10.0
}
fn sand_young() -> f32 {
    5e5
}
fn sand_poisson() -> f32 {
    0.3
}
fn sand_friction() -> f32 {
    0.6
}
fn kinematic() -> f32 {
    5e-3
}
fn bulk() -> f32 {
    2e5
}
fn exponent() -> f32 {
    7.0
}

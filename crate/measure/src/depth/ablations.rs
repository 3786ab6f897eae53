//! Settings with a part of the engine left out: what each part brings.

use scanstitch::odometry::depth::Effort;
use scanstitch::pipeline::spatial_settings::{ColorUse, LoopClosing, Quantisation, SpatialSettings};
use scanstitch::registration::solver::Motion;

/// Settings under a name.
pub struct Variant {
    pub name: &'static str,
    pub settings: SpatialSettings,
}

/// The settings as they are.
pub fn unchanged(settings: &SpatialSettings) -> Vec<Variant> {
    vec![Variant { name: "as set", settings: settings.clone() }]
}

/// The settings as they are, and with one part after another left out.
pub fn ablations(settings: &SpatialSettings) -> Vec<Variant> {
    let with = |name, change: fn(&mut SpatialSettings)| {
        let mut settings = settings.clone();
        change(&mut settings);
        Variant { name, settings }
    };
    vec![
        with("default", |_| ()),
        with("without half a step of depth", |settings| settings.quantisation = Quantisation::Rounded),
        with("planar", |settings| settings.motion = Motion::Planar),
        with("without colours", |settings| settings.color = ColorUse::NotUsed),
        with("without loops closed", |settings| settings.loop_closing = LoopClosing::Off),
        with("quick", |settings| settings.effort = Effort::Quick),
    ]
}

//! What has become of the guess that the azimuth tells when the points of a cloud without times were measured.

use crate::odometry::cloud::{AzimuthGuess, CloudOptions};
use crate::pipeline::prepared_frame::DecodeConfig;
use crate::pipeline::spatial_settings::Method;
use crate::preprocess::azimuth_clock::AzimuthClock;

/// What is known of it.
pub(super) enum AzimuthTimes {
    /// It is tested with each cloud.
    Open(Box<AzimuthGuess>, Box<CloudOptions>),
    /// Clouds are straightened by this clock.
    Confirmed(AzimuthClock),
    /// They are left as they are: there is nothing to guess, the data refute it, or they leave it open.
    Dropped { is_refuted: bool },
}

impl AzimuthTimes {
    pub(super) fn new(config: &DecodeConfig) -> Self {
        let is_tested = config.settings.method == Method::CloudMap;
        match config.cloud.as_ref().filter(|_| is_tested).and_then(|cloud| cloud.seam) {
            Some(seam) => Self::Open(Box::new(AzimuthGuess::new(seam)), Box::new(config.cloud_options())),
            None => Self::Dropped { is_refuted: false },
        }
    }

    /// What was decided, in a whole sentence.
    pub(super) fn note(&self) -> Option<String> {
        match self {
            Self::Confirmed(AzimuthClock { is_clockwise, .. }) => Some(format!(
                "Points have no times. Taken by their azimuth, of a lidar that turns {} ten times a second, clouds fit one another better \
                 than as they are",
                if *is_clockwise { "clockwise" } else { "counterclockwise" }
            )),
            Self::Dropped { is_refuted: true } => Some(
                "Points have no times. Clouds fit one another better as they are than straightened by times of their azimuth: they seem \
                 to have been straightened already"
                    .to_owned(),
            ),
            Self::Open(..) | Self::Dropped { is_refuted: false } => None,
        }
    }
}

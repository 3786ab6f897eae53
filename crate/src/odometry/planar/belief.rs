//! Good, doubtful or lost: the one file that reads a planar frame's status from what was found of it. Nothing edits it afterwards.

use super::FrameEstimate;
use crate::odometry::assessment::{Assessment, Status};

/// How the odometry bears on a frame's registration.
#[derive(Debug, Clone, PartialEq)]
pub enum ByOdometry {
    /// It tells nothing of it.
    Nothing,
    /// Both agree: people may stand in the way, and what the walls leave open, the odometry tells.
    Confirmed,
    /// The frame is placed by the odometry alone.
    Placed(Option<AwayFromOdometry>),
}

/// A registration that the odometry speaks against.
#[derive(Debug, Clone, PartialEq)]
pub struct AwayFromOdometry {
    /// Distance between the two (m).
    pub distance: f64,
    /// Difference of their headings (rad).
    pub turn: f64,
    /// Why the odometry is believed.
    pub why: WhyOdometry,
}

/// Why the odometry is believed against a registration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WhyOdometry {
    /// It is known to this standard deviation (m).
    Known(f64),
    /// The scan fits about as well where it leads.
    FitsThere,
    /// The scan fits worse between the two.
    NotBetween,
}

/// What speaks against the pose of a frame besides its registration.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// The scan before it fits the map nowhere.
    StrayBefore,
    /// Only this share of it (0..=1) lies on the map, and nothing else measures its motion.
    LittleOverlap(f64),
    /// It fits about as well elsewhere.
    Rival {
        /// How far away (m).
        distance: f64,
        /// Under which other heading (rad).
        turn: f64,
        /// Share of its returns that agree there and here (0..=1).
        agreement: (f64, f64),
    },
    /// Registration and odometry together leave its heading (rad) and position (m) open by these standard deviations.
    LeftOpen(f64, f64),
    /// Chain and odometry contradict each other over so many steps, by this distance (m) and turn (rad).
    ChainContradictsOdometry(usize, f64, f64),
    /// Its step is longer (m) than the longest that is sure (m).
    LongStep(f64, f64),
    /// Result and odometry contradict each other between two frames.
    ResultContradictsOdometry {
        /// The frames.
        frames: (usize, usize),
        /// Distance (m) and turn (rad) by the result.
        result: (f64, f64),
        /// The same by the odometry.
        odometry: (f64, f64),
    },
    /// Its piece of the map is too small to be sure.
    SmallPiece,
    /// One loop that was put in by hand tells alone where its part of the map lies.
    OneHand,
    /// A loop of the map was put in by hand, without a match of the scans.
    UncheckedLoop,
    /// Another recording has begun, and where that lies is not searched for.
    OtherRecording,
    /// The map may be a mirror image.
    Mirrored(&'static str),
}

impl FrameEstimate {
    /// How far the pose is to be trusted, with the reason.
    pub fn assessment(&self) -> Assessment {
        self.assessment_by(&self.findings)
    }

    /// The same by these of its findings.
    pub fn assessment_by(&self, findings: &[Finding]) -> Assessment {
        let Assessment { status, reason, agreement } = self.registered.clone();
        let (status, reason) = match (&self.by_odometry, status) {
            (ByOdometry::Nothing, _) | (ByOdometry::Confirmed, Status::Good | Status::Lost) => (status, reason),
            (ByOdometry::Confirmed, Status::Doubtful) => (Status::Good, String::new()),
            (ByOdometry::Placed(None), _) => (Status::Doubtful, reason),
            (ByOdometry::Placed(Some(away)), _) => (Status::Doubtful, away.reason()),
        };
        match findings.first().filter(|_| status == Status::Good) {
            Some(finding) => Assessment { status: Status::Doubtful, reason: finding.reason(), agreement },
            None => Assessment { status, reason, agreement },
        }
    }
}

impl AwayFromOdometry {
    fn reason(&self) -> String {
        let why = match self.why {
            WhyOdometry::Known(sigma) => format!("whose standard deviation is {:.1} mm", 1000.0 * sigma),
            WhyOdometry::FitsThere => "where it fits about as well".to_owned(),
            WhyOdometry::NotBetween => "and a pose between the two fits worse".to_owned(),
        };
        format!(
            "its best fit is {:.2} m and {:.0} degrees away from the measured motion, {why}: it is placed by the measured motion",
            self.distance,
            self.turn.to_degrees()
        )
    }
}

impl Finding {
    fn reason(&self) -> String {
        match *self {
            Self::StrayBefore => {
                "the previous scan does not fit the map, so the motion since then is unknown".to_owned()
            }
            Self::LittleOverlap(overlap) => {
                format!("only {:.0} % of it lies on the map, and nothing else measures its motion", 100.0 * overlap)
            }
            Self::Rival { distance, turn, agreement: (there, here) } => format!(
                "it fits about as well {distance:.1} m and {:.0} degrees away ({:.0} % of its returns agree there, {:.0} % here)",
                turn.to_degrees(),
                100.0 * there,
                100.0 * here
            ),
            Self::LeftOpen(heading, position) => format!(
                "its pose is uncertain by {position:.2} m and {:.1} degrees (one standard deviation), even with the measured motion",
                heading.to_degrees()
            ),
            Self::ChainContradictsOdometry(num_steps, distance, turn) => format!(
                "over {num_steps} steps the scans and the measured motion differ by {distance:.2} m and {:.1} degrees, and nothing \
                 shows which is right",
                turn.to_degrees()
            ),
            Self::LongStep(length, longest) => format!(
                "it lies {length:.1} m from the scan before, and the longest step that is sure is {longest:.1} m: the place may only \
                 look alike"
            ),
            Self::ResultContradictsOdometry { frames: (first, last), result, odometry } => {
                let told = |(way, turn): (f64, f64)| format!("{way:.2} m and {:.1} degrees", turn.to_degrees());
                let (result, odometry) = (told(result), told(odometry));
                format!(
                    "between frames {first} and {last} the result moves by {result}, the odometry by {odometry}: they contradict each \
                     other"
                )
            }
            Self::OneHand => {
                "its part of the map was joined to the rest by one loop that was put in by hand: a second one, elsewhere, confirms it"
                    .to_owned()
            }
            Self::UncheckedLoop => "a loop of the map was put in by hand, without a match of the scans".to_owned(),
            Self::OtherRecording => {
                "another recording has begun, and only the joint strategy searches for where it lies".to_owned()
            }
            Self::SmallPiece => {
                "it fits the scans before it, but their own position is uncertain: a link of the path to them is doubtful, and no loop \
                 confirms it"
                    .to_owned()
            }
            Self::Mirrored(reason) => reason.to_owned(),
        }
    }
}

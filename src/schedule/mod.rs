//! How a frame's time is spent: budgets, nominal costs and the ranking of what could be refined next.
//!
//! This is the benefit/cost greedy of Funkhouser and Sequin ("Adaptive Display Algorithm for Interactive Frame Rates
//! During Visualization of Complex Virtual Environments", SIGGRAPH 93, pp. 247-254): of everything that could be refined,
//! do next what takes away most error per cost. Benefits are summed squared errors in squared 8-bit codes, because what
//! is reported is a root mean square; costs are [nominal nanoseconds](cost), never measured time, so that the order of
//! work is the same on every machine and for any number of threads.
//!
//! The scheduler knows candidates by number and what they are worth; triangles are none of its business.

mod budget;
mod cancel;
pub mod cost;
mod ladder;
mod list;
mod model;
mod queue;
mod rank;
mod rate;
mod record;

pub use budget::{Allowance, Budget};
pub use cancel::CancelToken;
pub use ladder::{DIVISORS, Forecast, Ladder};
pub use list::RankedList;
pub use model::{CostModel, Kind, Load, Rate};
pub use queue::RankedQueue;
pub use rank::Rank;
pub use rate::LearnedRate;
pub use record::FrameRecord;

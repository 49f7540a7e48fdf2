//! What holds whatever the clock says: deadlines, the ladder of smaller and older images, replays, spare time.
//!
//! Time comes from clocks that count how often they are read, so nothing here waits or depends on the machine.

mod budgets;
mod common;
mod damage;
mod ladder;
mod odd_clocks;
mod reduced;
mod replay;
mod spare;
mod timing;

//! The contract of backends, checked on all of them.

use specula::BackendKind;
use specula::backend::recording::RecordingBackend;
use specula::backend::suite;

#[test]
fn software_keeps_the_contract() {
    suite::check(|| BackendKind::Software.create());
}

#[test]
fn skia_keeps_the_contract() {
    suite::check(|| BackendKind::Skia.create());
}

#[test]
fn a_recording_of_either_keeps_the_contract() {
    for kind in BackendKind::ALL {
        suite::check(|| Box::new(RecordingBackend::new(kind.create()).0));
    }
}

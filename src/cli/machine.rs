//! Facts about the machine and the program, for the record.

use super::args::Machine;
use serde::Serialize;
use std::time::SystemTime;

/// What measurements depend on besides the scene.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Facts {
    /// The program's version.
    pub(super) specula: &'static str,
    /// When, in UTC.
    pub(super) date: String,
    /// The processor's name.
    pub(super) cpu: String,
    /// Threads used.
    pub(super) threads: usize,
    /// SIMD level used.
    pub(super) simd: String,
    /// What draws.
    pub(super) backend: String,
    /// Image width in pixels.
    pub(super) width: u32,
    /// Image height in pixels.
    pub(super) height: u32,
}

impl Facts {
    /// Here and now.
    pub(super) fn new(machine: &Machine) -> Self {
        Self {
            specula: env!("CARGO_PKG_VERSION"),
            date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            cpu: cpu_model(),
            threads: machine.thread_count(),
            simd: machine.simd_level().to_string(),
            backend: machine.backend.to_string(),
            width: machine.size.width,
            height: machine.size.height,
        }
    }

    /// The facts that fit into a line, for people.
    pub(super) fn line(&self) -> String {
        let threads = match self.threads {
            1 => "1 thread".to_owned(),
            count => format!("{count} threads"),
        };
        format!(
            "{}x{}, {threads}, {}, {}",
            self.width, self.height, self.simd, self.cpu
        )
    }
}

/// The processor's name where the system tells it.
pub(super) fn cpu_model() -> String {
    std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| model_name(&text))
        .unwrap_or_else(|| format!("unknown ({})", std::env::consts::ARCH))
}

fn model_name(cpuinfo: &str) -> Option<String> {
    cpuinfo.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| value.trim().to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::model_name;

    #[test]
    fn the_model_is_found_among_the_processors_facts() {
        let text =
            "processor\t: 0\nmodel\t\t: 85\nmodel name\t: A CPU @ 2.00GHz\n\nprocessor\t: 1\n";
        assert_eq!(model_name(text).as_deref(), Some("A CPU @ 2.00GHz"));
        assert_eq!(model_name("Features : fp asimd\n"), None);
    }
}

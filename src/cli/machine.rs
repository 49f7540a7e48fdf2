//! Facts about the machine, for the record.

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

//! The CAN interfaces of this computer.

use std::fs;
use std::path::Path;

/// Where Linux lists network interfaces.
const FOLDER: &str = "/sys/class/net";
/// `ARPHRD_CAN` of Linux.
const CAN: &str = "280";
/// `IFF_UP` of Linux.
const UP: u32 = 1;

/// A CAN interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Its name, such as `vcan0`.
    pub name: String,
    /// Whether it is up.
    pub is_up: bool,
    /// Whether there is no cable behind it.
    pub is_virtual: bool,
}

/// Returns the CAN interfaces, by name; none where the system does not list them.
#[must_use]
pub fn interfaces() -> Vec<Interface> {
    list(Path::new(FOLDER))
}

impl Interface {
    /// Returns what is known of the interface `name`, which may not exist: without the system's
    /// word, what is called `vcan…` is virtual and everything else is not.
    #[must_use]
    pub fn named(name: &str) -> Self {
        let known = interfaces().into_iter().find(|known| known.name == name);
        known.unwrap_or_else(|| Self {
            name: name.to_owned(),
            is_up: false,
            is_virtual: name.starts_with("vcan"),
        })
    }
}

fn list(folder: &Path) -> Vec<Interface> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut found: Vec<_> = entries
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_str()?.to_owned();
            let kind = fs::read_to_string(path.join("type")).ok()?;
            if kind.trim() != CAN {
                return None;
            }
            let flags = fs::read_to_string(path.join("flags")).ok()?;
            let digits = flags.trim().trim_start_matches("0x");
            let flags = u32::from_str_radix(digits, 16).ok()?;
            // A serial line's interface counts as virtual for the system, and has a cable.
            let is_virtual = !name.starts_with("slcan")
                && path
                    .canonicalize()
                    .is_ok_and(|real| real.to_string_lossy().contains("/virtual/"));
            Some(Interface {
                name,
                is_up: flags & UP != 0,
                is_virtual,
            })
        })
        .collect();
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_can_interface_is_told_from_others_and_a_virtual_one_from_a_real_one() {
        let root = std::env::temp_dir().join(format!("eel-interfaces-{}", std::process::id()));
        let class = root.join("class");
        fs::create_dir_all(&class).unwrap();
        let all = [
            ("virtual/net", "vcan0", "280", "0x40081"),
            ("virtual/net", "lo", "772", "0x9"),
            ("virtual/net", "slcan0", "280", "0x40081"),
            ("pci/usb/net", "can0", "280", "0x40080"),
        ];
        for (place, name, kind, flags) in all {
            let device = root.join("devices").join(place).join(name);
            fs::create_dir_all(&device).unwrap();
            fs::write(device.join("type"), format!("{kind}\n")).unwrap();
            fs::write(device.join("flags"), format!("{flags}\n")).unwrap();
            std::os::unix::fs::symlink(&device, class.join(name)).unwrap();
        }
        let found = list(&class);
        fs::remove_dir_all(&root).unwrap();
        let told: Vec<_> = found
            .iter()
            .map(|known| (known.name.as_str(), known.is_up, known.is_virtual))
            .collect();
        let expected = [
            ("can0", false, false),
            ("slcan0", true, false),
            ("vcan0", true, true),
        ];
        assert_eq!(told, expected);
        assert_eq!(list(&root.join("nothing")), []);
    }
}

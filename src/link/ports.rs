//! Serial ports of this computer, so that a link can be chosen from a list instead of being typed.

use std::fs;
use std::path::Path;

use serialport::SerialPortType;

pub use crate::session::wire::SerialPortName;

/// Folder in which the system names serial ports by their adapters; these names survive replugging.
const BY_ID: &str = "/dev/serial/by-id";

/// The serial ports that an instrument can be on, those of adapters first. Empty if the system cannot list them.
pub fn serial_ports() -> Vec<SerialPortName> {
    let persistent = persistent_names(Path::new(BY_ID));
    let found = serialport::available_ports().unwrap_or_default();
    let mut ports: Vec<(bool, SerialPortName)> = found
        .into_iter()
        .filter(|port| !matches!(port.port_type, SerialPortType::BluetoothPort))
        .map(|port| {
            let named = persistent.iter().find(|(_, target)| *target == port.port_name);
            let device = named.map_or_else(|| port.port_name.clone(), |(name, _)| name.clone());
            (
                !matches!(port.port_type, SerialPortType::UsbPort(_)),
                SerialPortName { device, description: described(&port.port_type) },
            )
        })
        .collect();
    ports.sort();
    ports.into_iter().map(|(_, port)| port).collect()
}

fn described(kind: &SerialPortType) -> String {
    let SerialPortType::UsbPort(usb) = kind else { return String::new() };
    let words: Vec<&str> = [&usb.manufacturer, &usb.product].into_iter().flatten().map(|word| word.trim()).collect();
    crate::text::printable(&words.join(" "))
}

/// Names in a folder of links with the devices that they lead to.
fn persistent_names(folder: &Path) -> Vec<(String, String)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let pair = |entry: fs::DirEntry| {
        let target = fs::canonicalize(entry.path()).ok()?;
        Some((entry.path().to_str()?.to_owned(), target.to_str()?.to_owned()))
    };
    entries.filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn persistent_names_lead_to_their_devices_and_a_missing_folder_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let device = folder.path().join("ttyUSB7");
        fs::File::create_new(&device).unwrap();
        let links = folder.path().join("by-id");
        fs::create_dir(&links).unwrap();
        std::os::unix::fs::symlink(&device, links.join("usb-maker-if00")).unwrap();
        let names = persistent_names(&links);
        let device = fs::canonicalize(&device).unwrap();
        assert_eq!(
            names,
            [(links.join("usb-maker-if00").to_str().unwrap().to_owned(), device.to_str().unwrap().to_owned())]
        );
        assert_eq!(persistent_names(Path::new("/there/is/no/such/folder")), []);
        // Whatever this computer has, the list has no port twice.
        let ports = serial_ports();
        assert!(ports.windows(2).all(|pair| pair[0].device != pair[1].device), "{ports:?}");
    }
}

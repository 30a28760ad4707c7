//! The USB identities of boards that are made into rigs. `haptic-ctl devices` and `doctor` name a board by them, and
//! the package's udev rules keep ModemManager away from it, whether a configuration names it or not.

/// A board, or a converter in front of one, as USB knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UsbBoard {
    /// USB vendor.
    pub vendor: u16,
    /// USB product.
    pub product: u16,
    /// Its name.
    pub name: &'static str,
    /// Whether other devices have this identity too, a modem perhaps: it is that of a converter, or of a vendor's
    /// example.
    pub is_shared: bool,
    /// Where the identity is published.
    pub source: &'static str,
}

const ARDUINO: &str = "ArduinoCore-avr, boards.txt";
const PICO: &str = "github.com/raspberrypi/usb-pid";
const TEENSY: &str = "github.com/PaulStoffregen/cores, teensy4/usb_desc.h";
const LINUX_FTDI: &str = "Linux, drivers/usb/serial/ftdi_sio_ids.h";
const LINUX_CH341: &str = "Linux, drivers/usb/serial/ch341.c";
const LINUX_CP210X: &str = "Linux, drivers/usb/serial/cp210x.c";
const ESPTOOL: &str = "github.com/espressif/esptool, esptool/loader.py";
const STM32: &str = "STM32Cube, usbd_desc.c of its CDC examples";
const ODRIVE: &str = "docs.odriverobotics.com, the udev rules";

/// Those that are known, by vendor.
pub static BOARDS: [UsbBoard; 17] = [
    own(0x2341, 0x0001, "Arduino Uno", ARDUINO),
    own(0x2341, 0x0043, "Arduino Uno", ARDUINO),
    own(0x2341, 0x006A, "Arduino Uno", ARDUINO),
    own(0x2341, 0x0243, "Arduino Uno", ARDUINO),
    own(0x2A03, 0x0043, "Arduino Uno", ARDUINO),
    own(0x2E8A, 0x0005, "RP2040 with MicroPython", PICO),
    own(0x2E8A, 0x0009, "RP2350 with the Pico SDK", PICO),
    own(0x2E8A, 0x000A, "RP2040 with the Pico SDK", PICO),
    own(0x16C0, 0x0483, "Teensy, serial", TEENSY),
    own(0x16C0, 0x0486, "Teensy, raw HID", TEENSY),
    own(0x303A, 0x1001, "ESP32-C3, -C6 or -S3, its own USB port", ESPTOOL),
    own(0x1209, 0x0D32, "ODrive", ODRIVE),
    shared(
        0x0403,
        0x6001,
        "FTDI FT232R converter, as on an Arduino Nano",
        LINUX_FTDI,
    ),
    shared(
        0x1A86,
        0x7523,
        "CH340 converter, as on clones of Uno and Nano",
        LINUX_CH341,
    ),
    shared(0x10C4, 0xEA60, "CP2102 converter, as on ESP32 boards", LINUX_CP210X),
    shared(0x0483, 0x5740, "STM32, virtual serial port", STM32),
    shared(
        0x0483,
        0x374B,
        "ST-LINK of an STM32 Nucleo",
        "OpenOCD, contrib/60-openocd.rules",
    ),
];

const fn own(vendor: u16, product: u16, name: &'static str, source: &'static str) -> UsbBoard {
    UsbBoard {
        vendor,
        product,
        name,
        is_shared: false,
        source,
    }
}

const fn shared(vendor: u16, product: u16, name: &'static str, source: &'static str) -> UsbBoard {
    UsbBoard {
        is_shared: true,
        ..own(vendor, product, name, source)
    }
}

/// The board with this identity, if it is known.
#[must_use]
pub fn named(vendor: u16, product: u16) -> Option<&'static UsbBoard> {
    BOARDS
        .iter()
        .find(|board| (board.vendor, board.product) == (vendor, product))
}

/// The udev rules by which ModemManager leaves the boards alone that have an identity of their own.
#[must_use]
pub fn modem_manager_rules() -> String {
    let own = BOARDS.iter().filter(|board| !board.is_shared);
    own.map(|board| {
        format!(
            "SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"{:04x}\", ATTR{{idProduct}}==\"{:04x}\", \
             ENV{{ID_MM_DEVICE_IGNORE}}=\"1\"\n",
            board.vendor, board.product
        )
    })
    .collect()
}

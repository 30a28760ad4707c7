#!/bin/sh
# Compiles an Arduino sketch for an Uno with Debian's arduino-core-avr, as the Arduino IDE would:
#
#     tests/arduino-avr.sh SKETCH.ino OUT.elf [FOLDER of a library's sources]...
#
# It prints the size of program and data. EXTRA has more options for the compiler.
set -eu
here=$(dirname "$(readlink -f "$0")")/..
core=/usr/share/arduino/hardware/arduino/avr
sketch=$1 out=$2
shift 2
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
common="-mmcu=atmega328p -DF_CPU=16000000L -DARDUINO=10819 -DARDUINO_AVR_UNO -DARDUINO_ARCH_AVR ${EXTRA-}
    -DDECIMAL_DIG=__DECIMAL_DIG__ -Os -flto -ffunction-sections -fdata-sections
    -I$core/cores/arduino -I$core/variants/standard -I$here/src -I$core/libraries/Wire/src -I$core/libraries/SPI/src"
for folder in "$@"; do common="$common -I$folder"; done
compiled() {
    echo "$work/$(echo "$1" | tr / _).o"
}
# shellcheck disable=SC2086 # the options are words
{
    avr-gcc $common -std=gnu11 -Wall -Wextra -Werror -c "$here/src/haptic_device.c" -o "$(compiled library)"
    for source in "$core"/cores/arduino/*.c; do
        avr-gcc $common -std=gnu11 -w -c "$source" -o "$(compiled "$source")"
    done
    for source in "$core"/cores/arduino/*.cpp $(for f in "$@"; do find "$f" -name '*.cpp' ! -name '*I2C*' ! -name '*SPI*'; done); do
        avr-g++ $common -std=gnu++11 -fno-exceptions -fno-threadsafe-statics -fpermissive -w -c "$source" -o "$(compiled "$source")"
    done
    avr-g++ $common -std=gnu++11 -fno-exceptions -fno-threadsafe-statics -Wall -x c++ -include Arduino.h -c "$sketch" \
        -o "$(compiled sketch)"
}
avr-gcc -mmcu=atmega328p -Os -flto -fuse-linker-plugin -Wl,--gc-sections -o "$out" "$work"/*.o -lm
avr-size -C --mcu=atmega328p "$out" | grep -E 'Program|Data'

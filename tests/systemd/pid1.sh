#!/bin/sh
# Boots a Debian's systemd as PID 1 of namespaces of its own: pid1.sh ROOT STAGE CGROUP
#   ROOT       the Debian, which is only read; all changes are in memory
#   STAGE/etc  what its /etc has besides
#   CGROUP     an empty cgroup (v2), which becomes the root of the new one
# Run as root. Nothing that happens inside reaches this machine: its own processes, network and host name, /sys and /proc/sys read-only, and
# no right to load modules or set the clock.
set -eu

if [ "${4-}" != inside ]; then
    echo $$ >"$3/cgroup.procs"
    # However the caller ends, all of it ends.
    exec setpriv --pdeathsig KILL unshare --mount --pid --net --ipc --uts --cgroup --fork --kill-child sh "$0" "$1" "$2" "$3" inside
fi

stage=$2
root=$stage/root
mount --make-rprivate /
mkdir "$root" "$stage/memory"
mount -t tmpfs -o mode=755 memory "$stage/memory"
mkdir "$stage/memory/changes" "$stage/memory/work"
mount -t overlay -o "lowerdir=$1,upperdir=$stage/memory/changes,workdir=$stage/memory/work" debian "$root"
cp -R "$stage/etc" "$root/"

mount -t proc proc "$root/proc"
mount --bind "$root/proc/sys" "$root/proc/sys"
mount -o remount,bind,ro "$root/proc/sys"
mount -t sysfs -o ro sysfs "$root/sys"
mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"

mount -t tmpfs -o mode=755 dev "$root/dev"
node() { mknod -m "$2" "$root/dev/$1" c "$3" "$4"; }
node null 666 1 3
node zero 666 1 5
node full 666 1 7
node random 666 1 8
node urandom 666 1 9
node tty 666 5 0
# Nodes of its own: what the package does to their owners is not done to this machine's.
if [ -e /dev/cpu_dma_latency ]; then
    # shellcheck disable=SC2046 # two numbers
    node cpu_dma_latency 600 $(sed -n 's/^/10 /; s/ *cpu_dma_latency$//p' /proc/misc)
fi
mkdir "$root/dev/shm" "$root/dev/pts"
mount -t tmpfs -o mode=1777 shm "$root/dev/shm"
mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
ln -s pts/ptmx "$root/dev/ptmx"

mkdir "$root/old"
cd "$root"
pivot_root . old
umount -l /old
cd /
exec env -i container=hapticd-test PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    setpriv --bounding-set -sys_module,-sys_boot,-sys_time,-sys_rawio,-syslog \
    /usr/lib/systemd/systemd --system --unit=basic.target --show-status=no

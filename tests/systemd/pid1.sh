#!/bin/sh
# Boots this machine's systemd as PID 1 of namespaces of its own: pid1.sh STAGE CGROUP
#   STAGE/etc  all of /etc
#   CGROUP     an empty cgroup (v2), which becomes the root of the new one
# Run as root. Nothing that happens inside reaches the machine: its own processes, network and host name, this machine's programs and
# list of packages with all changes in memory, /sys and /proc/sys read-only, and no right to load modules or set the clock.
set -eu

if [ "${3-}" != inside ]; then
    echo $$ >"$2/cgroup.procs"
    # However the caller ends, all of it ends.
    exec setpriv --pdeathsig KILL unshare --mount --pid --net --ipc --uts --cgroup --fork --kill-child sh "$0" "$1" "$2" inside
fi

stage=$1
root=$stage/root
mount --make-rprivate /
mkdir -p "$root"
mount -t tmpfs -o mode=755 root "$root"
mkdir "$root/usr" "$root/proc" "$root/sys" "$root/dev" "$root/var" "$root/run" "$root/tmp" "$root/root" "$root/old"
for link in bin sbin lib lib32 lib64 libx32; do
    if [ -L "/$link" ]; then cp -P "/$link" "$root/$link"; fi
done
cp -R "$stage/etc" "$root/etc"
mkdir -p "$root/old/changes/usr" "$root/old/changes/dpkg" "$root/old/work/usr" "$root/old/work/dpkg" "$root/var/lib/dpkg" "$root/var/log"
over() { mount -t overlay -o "lowerdir=$1,upperdir=$root/old/changes/$2,workdir=$root/old/work/$2" "$2" "$root$1"; }
over /usr usr
over /var/lib/dpkg dpkg
# Other packages' groups do not exist there.
: >"$root/var/lib/dpkg/statoverride"
# This machine may be a container that starts no services.
rm -f "$root/usr/sbin/policy-rc.d"

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

mkdir "$root/old/system"
cd "$root"
pivot_root . old/system
umount -l /old/system
exec env -i container=hapticd-test PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    setpriv --bounding-set -sys_module,-sys_boot,-sys_time,-sys_rawio,-syslog \
    /usr/lib/systemd/systemd --system --unit=basic.target --show-status=no

#!/usr/bin/env bash
# Prepares a release in a clone of this repository: `packaging/release.sh --help` says what.
set -euo pipefail

usage() {
    cat <<'END'
Usage: packaging/release.sh VERSION [--out DIR] [--profile PROFILE] [--dry-run]

Prepares a release of what is committed, in a clone; this repository is not changed, and nothing is tagged.

  VERSION            as in 1.0.0, 1.0.0-rc or 1.0.0-rc.1
  --out DIR          folder of the release, which must not exist [default: target/hapticd-VERSION]
  --profile PROFILE  profile of the programs [default: release]; dev shows in minutes whether all is in place
  --dry-run          end before anything is compiled

DIR/source is the clone, with a commit that sets the version and cuts the changelog; DIR/tag.txt the text of its tag;
DIR/dist the Debian packages, a tarball of static programs for other distributions, the Python wheels, the licences of
all dependencies and SHA256SUMS. The same commit gives
the same bytes with the same compiler, in whatever folder; but the wheel of the core (hapticd_core) in the same folder
alone: Cargo reckons the absolute path of crates outside a workspace into the names of their symbols, and it orders by them.
END
}

fail() {
    echo "release.sh: $*" >&2
    exit 1
}

repository=$(cd "$(dirname "$0")/.." && pwd)
version='' out='' profile=release dry_run=''
while [ $# != 0 ]; do
    case $1 in
        --help) usage && exit ;;
        --out) out=${2:?--out wants a folder} && shift ;;
        --profile) profile=${2:?--profile wants a name} && shift ;;
        --dry-run) dry_run=yes ;;
        -*) usage >&2 && fail "unknown option: $1" ;;
        *) [ -z "$version" ] || fail "a second version: $1" && version=$1 ;;
    esac
    shift
done
[ -n "$version" ] || { usage >&2 && fail 'a version is wanted'; }
[[ $version =~ ^[0-9]+\.[0-9]+\.[0-9]+(-rc(\.[0-9]+)?)?$ ]] || fail "version $version: expected one as in 1.0.0, 1.0.0-rc or 1.0.0-rc.1"
# The path before it is entered, from where it was named.
out=$(realpath -m "${out:-$repository/target/hapticd-$version}")
[ ! -e "$out" ] || fail "$out exists: move it away, or name another --out"

cd "$repository"
changed=$(git status --porcelain)
[ -z "$changed" ] || fail "the tree has changes that are not committed:
$changed"
grep -q "^## ${version//./\\.}," CHANGELOG.md && fail "CHANGELOG.md has $version already"
git rev-parse --quiet --verify "refs/tags/v$version" >/dev/null && fail "the tag v$version exists"

# The time of everything that is made is that of the commit.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH TZ=UTC LC_ALL=C.UTF-8
umask 022
mkdir -p "$out/dist"
git clone --quiet --no-local "$repository" "$out/source"
cd "$out/source"

# Debian and Python write a candidate their own way: it comes before the release.
debian_version=${version/-/\~}
python_version=${version/%-rc/rc0}
python_version=${python_version/-rc./rc}
day=$(date -d "@$SOURCE_DATE_EPOCH" +%F)

set_version() {
    sed -i "/^\[workspace\.package\]/,/^\[/ s/^version = .*/version = \"$version\"/" Cargo.toml
    sed -i "/^\[package\]/,/^\[/ s/^version = .*/version = \"$version\"/" python/core/Cargo.toml
    sed -i "/^\[project\]/,/^\[/ s/^version = .*/version = \"$python_version\"/" python/pyproject.toml
    sed -i "s|^  <releases>|&\n    <release version=\"$version\" date=\"$day\"/>|" packaging/gui/*.metainfo.xml
    local package changelog
    for package in hapticd haptic-gui; do
        changelog=packaging/changelog
        [ $package = hapticd ] || changelog=packaging/gui/changelog
        {
            printf '%s (%s) unstable; urgency=medium\n\n' "$package" "$debian_version"
            printf '  * What changed is in CHANGELOG.md of the source.\n\n'
            printf ' -- %s  %s\n\n' "$(sed -n 's/^maintainer = "\(.*\)"/\1/p' crates/hapticd/Cargo.toml)" \
                "$(date -R -d "@$SOURCE_DATE_EPOCH")"
            cat "$changelog"
        } >"$changelog.new"
        mv "$changelog.new" "$changelog"
    done
    # The lock files follow. Cargo would ask for all that other systems want, too.
    local lock
    for lock in Cargo.lock python/core/Cargo.lock; do
        # Ours come from nowhere.
        awk -v version="$version" 'BEGIN { RS = "" } NR > 1 { print "" }
            !/\nsource = / { sub(/\nversion = "[^"]*"/, "\nversion = \"" version "\"") } { print }' $lock >$lock.new
        mv $lock.new $lock
    done
}

# Puts the version above what is unreleased; what stands there is the text of the tag.
cut_changelog() {
    local unreleased
    unreleased=$(awk '/^## /{within = /^## Unreleased$/; next} within' CHANGELOG.md)
    [ -n "${unreleased//[[:space:]]/}" ] || fail 'CHANGELOG.md has nothing under Unreleased'
    sed -i "s/^## Unreleased$/&\n\n## $version, $day/" CHANGELOG.md
    printf 'hapticd %s\n\n%s\n' "$version" "$(sed '/./,$!d' <<<"$unreleased")" >"$out/tag.txt"
}

commit() {
    git add --all
    GIT_AUTHOR_DATE="@$SOURCE_DATE_EPOCH +0000" GIT_COMMITTER_DATE="@$SOURCE_DATE_EPOCH +0000" \
        git commit --quiet --message "Version $version"
}

# The licences of all crates that are compiled in, which deny.toml permits.
licences() {
    packaging/licences.py Cargo.toml >"$out/dist/licences-of-hapticd.txt"
    packaging/licences.py python/core/Cargo.toml >"$out/dist/licences-of-hapticd-core.txt"
    # Where the packages take it from.
    cp "$out/dist/licences-of-hapticd.txt" packaging/licences.txt
}

# No path of this machine is in what is compiled: the same bytes come out of every folder, but for the wheel of the core.
compile_alike() {
    local toolchain
    toolchain=$(rustc --print sysroot)
    export RUSTFLAGS="--remap-path-prefix=$out=/build --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=/cargo --remap-path-prefix=$toolchain=/rust"
    export CFLAGS="-ffile-prefix-map=$out=/build"
    export CARGO_TARGET_DIR=$out/build CARGO_INCREMENTAL=0
}

debian_packages() {
    cargo build --locked --profile "$profile" --bins -p hapticd -p haptic-ctl -p haptic-gui
    local package folder=$profile
    [ "$profile" != dev ] || folder=debug
    for package in hapticd haptic-gui; do
        packaging/generate.sh "$package" "$CARGO_TARGET_DIR/$folder"
        cargo deb --no-build --locked --profile "$profile" --variant release --package "$package" \
            --deb-version "$debian_version" --output "$out/dist/"
    done
}

wheels() {
    local venv=$out/venv
    python3 -m venv "$venv"
    MATURIN_PEP517_ARGS="--profile $profile --locked" "$venv/bin/pip" wheel --quiet --disable-pip-version-check \
        --no-deps --wheel-dir "$out/dist" ./python ./python/core
}

# What the package of hapticd installs, below one folder and with static programs: it runs on any Linux of this processor.
static_tarball() {
    local processor name folder=$profile
    processor=$(uname -m)
    name=hapticd-$version-$processor-linux
    [ "$profile" != dev ] || folder=debug
    rustup target add "$processor-unknown-linux-musl"
    cargo build --locked --profile "$profile" --target "$processor-unknown-linux-musl" --bins -p hapticd -p haptic-ctl
    local tree=$out/$name
    dpkg-deb --extract "$out"/dist/hapticd_*.deb "$tree"
    mv "$tree"/usr/* "$tree"
    rmdir "$tree/usr"
    install -m 755 "$CARGO_TARGET_DIR/$processor-unknown-linux-musl/$folder"/{hapticd,haptic-ctl} "$tree/bin/"
    cp packaging/tarball.md "$tree/README.md"
    tar --create --use-compress-program='gzip --best --no-name' --file "$out/dist/$name.tar.gz" --directory "$out" --sort=name --owner=0 --group=0 --numeric-owner \
        --mtime="@$SOURCE_DATE_EPOCH" "$name"
    rm -r "$tree"
}

# What names this folder has other bytes when it is made elsewhere.
name_no_folder() {
    local file unpacked=$out/unpacked
    for file in "$out"/dist/*.deb "$out"/dist/*.whl "$out"/dist/*.tar.gz; do
        mkdir "$unpacked"
        case $file in
            *.deb) dpkg-deb --extract "$file" "$unpacked" ;;
            *.tar.gz) tar --extract --file "$file" --directory "$unpacked" ;;
            *.whl) python3 -m zipfile --extract "$file" "$unpacked" ;;
        esac
        ! grep -raF -m 1 -- "$out" "$unpacked" | cut -c 1-300 | grep . >&2 || fail "${file##*/} names the folder of its build"
        rm -r "$unpacked"
    done
}

set_version
cut_changelog
commit
if [ -n "$dry_run" ]; then
    cat "$out/tag.txt"
    exit
fi
licences
compile_alike
debian_packages
static_tarball
wheels
name_no_folder
(cd "$out/dist" && sha256sum -- * >SHA256SUMS)
cat "$out/dist/SHA256SUMS"
cat <<END

Look at it: git -C $out/source show
Then:       git pull $out/source && git tag --annotate --file $out/tag.txt v$version && git push --follow-tags
END

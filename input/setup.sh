# Set-up shared by input/run and tests/run (sourced by bash): packages, a suitable python3, configure and build.
# The caller defines `root` (the repository) and `me` (its own name, for messages).
# Sets `build_root`, where all builds, logs and results go, and by `prepare` also `python`.

build_root=${UNILAT_BUILD_ROOT:-$root/.build}
cores=$(nproc)  # asked before the next line, which nproc would obey
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 MPLBACKEND=Agg
setup_failed=4  # exit code when the program could not be set up; those of unilat are 0 to 3

say() { echo "$me: $*" >&2; }
die() { say "$1"; exit $setup_failed; }

# Is a Debian package there, or what it brings? Libraries are searched for where the compiler looks.
has() {
   local file
   case $1 in
      ninja-build) command -v ninja > /dev/null; return ;;
      liblapack-dev) file=liblapack.so ;;
      libopenblas-dev) file=libblas.so ;;  # any BLAS does
      libhdf5-dev) command -v h5fc > /dev/null; return ;;
      *) command -v "$1" > /dev/null; return ;;
   esac
   compgen -G "/usr/lib/*/$file" > /dev/null ||
      { command -v gfortran > /dev/null && [[ $(gfortran -print-file-name=$file) == /* ]]; }
}

# Prints those of the given packages that are missing.
missing() {
   local package
   for package in "$@"; do has "$package" || echo "$package"; done
}

# Sets `python` to the first python3 that imports the given modules (comma separated); the first on PATH need not be Debian's own.
find_python() {
   local candidate
   for candidate in ${UNILAT_PYTHON:+"$UNILAT_PYTHON"} python3 /usr/bin/python3 "$build_root/venv/bin/python"; do
      if python=$(command -v "$candidate") && "$python" -c "import $1" 2> /dev/null; then return 0; fi
   done
   python=
   return 1
}

# Sets `as_root` to what must stand before apt-get; fails when packages cannot be installed from here.
may_install() {
   command -v apt-get > /dev/null || return 1
   as_root=()
   [[ $(id -u) == 0 ]] && return 0
   as_root=(sudo)
   command -v sudo > /dev/null && sudo -n true 2> /dev/null
}

# Makes sure that everything is there that is needed to build and to run the given Python modules.
# usage: prepare "package ..." "module ..." ["package that is good to have ..."]
prepare() {
   local packages=($1) modules=($2) extra=(${3-}) need=() python_need=()
   local imports all
   imports=$(IFS=,; echo "${modules[*]}")
   mkdir -p "$build_root"
   mapfile -t need < <(missing "${packages[@]}")
   find_python "$imports" || python_need=(python3 "${modules[@]/#/python3-}")
   [[ ${#need[@]} == 0 && ${#python_need[@]} == 0 ]] && return 0

   if may_install; then
      all=("${need[@]}" "${python_need[@]}")
      say "installing ${all[*]}"
      if {
         "${as_root[@]}" apt-get update -qq &&
            "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
               "${all[@]}" $(missing "${extra[@]}")
      } > "$build_root/apt.log" 2>&1; then
         hash -r
      else
         say "apt-get failed; its last lines (all in $build_root/apt.log):"
         tail -n 5 "$build_root/apt.log" >&2
      fi
      mapfile -t need < <(missing "${packages[@]}")
      if find_python "$imports"; then python_need=(); fi
      [[ ${#need[@]} == 0 && ${#python_need[@]} == 0 ]] && return 0
   fi
   if [[ ${#need[@]} == 0 ]] && make_venv && find_python "$imports"; then return 0; fi

   all=("${need[@]}" "${python_need[@]}")
   say "missing: ${all[*]}"
   say "install them (the names are those of Debian and Ubuntu) and run $me again:"
   echo "   sudo apt-get update && sudo apt-get install -y --no-install-recommends ${all[*]}" >&2
   exit $setup_failed
}

# A virtual environment with the modules of `prepare`, for machines where apt-get may not be used.
make_venv() {
   command -v python3 > /dev/null || return 1
   say "no python3 here has ${modules[*]}: making a virtual environment in $build_root/venv"
   { python3 -m venv "$build_root/venv" &&
      "$build_root/venv/bin/python" -m pip install --quiet "${modules[@]}"; } > "$build_root/venv.log" 2>&1 ||
      { say "that failed:"; tail -n 1 "$build_root/venv.log" >&2; return 1; }
}

# Configures and builds $build_root/NAME with a preset; silent when all is well.
# usage: build NAME preset [cmake option ...]
build() {
   local folder=$build_root/$1 preset=$2 log=$build_root/$1.log
   shift 2
   # A repository that was copied or moved together with its builds starts afresh.
   if [[ -f $folder/CMakeCache.txt ]] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$folder/CMakeCache.txt"; then
      rm -rf "$folder"
   fi
   if ! { cmake -C "$root/.cmake/$preset.cmake" -S "$root" -B "$folder" -DUNILAT_PYTHON="$python" "$@" &&
      cmake --build "$folder" --parallel "$((cores + 1))"; } > "$log" 2>&1; then
      grep -vE '^\[[0-9]+/[0-9]+\] (Building|Generating|Linking)|^-- ' "$log" | tail -n 60 >&2
      die "the build failed (all its messages are in $log)"
   fi
}

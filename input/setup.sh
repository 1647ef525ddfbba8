# Set-up shared by input/run and tests/run (sourced by bash): packages, a suitable python3, configure and build.
# The caller defines `root` (the repository) and `me` (its own name, for messages).
# Sets `build_root`, where all builds, logs and results go, and by `prepare` also `python`.

build_root=${UNILAT_BUILD_ROOT:-$root/.build}
cores=$(nproc)  # asked before the next line, which nproc would obey
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 MPLBACKEND=Agg
setup_failed=4  # exit code when the program could not be set up; those of unilat are 0 to 3, 5 and 6

say() { echo "$me: $*" >&2; }
die() { say "$1"; exit "${2:-$setup_failed}"; }  # message, exit code

# Is a Debian package there, or what it brings? Libraries are searched for where the compiler looks.
has() {
   local file
   case $1 in
      ninja-build) command -v ninja > /dev/null; return ;;
      liblapack-dev) file=liblapack.so ;;
      libblas-dev) file=libblas.so ;;  # any BLAS does
      libopenblas-dev) file=libopenblas.so ;;
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
# The one that was found is remembered for these modules, and then only has to be there with them, which takes no import.
find_python() {
   local candidate found=$build_root/python-$1
   local there='import sys, importlib.util as util; sys.exit(any(util.find_spec(name) is None for name in sys.argv[1].split(",")))'
   if [[ -z ${UNILAT_PYTHON-} && -f $found ]] && python=$(< "$found") && [[ -x $python ]] && "$python" -c "$there" "$1"; then return 0; fi
   for candidate in ${UNILAT_PYTHON:+"$UNILAT_PYTHON"} python3 /usr/bin/python3 "$build_root/venv/bin/python"; do
      if python=$(command -v "$candidate") && "$python" -c "import $1" 2> /dev/null; then
         [[ -n ${UNILAT_PYTHON-} ]] || echo "$python" > "$found"
         return 0
      fi
   done
   python=
   return 1
}

# Prints the Debian packages of the given Python modules that Debian's python3 does not have, and python3 where there is none.
missing_modules() {
   local module
   [[ -x /usr/bin/python3 ]] || { printf '%s\n' python3 "${@/#/python3-}"; return; }
   for module in "$@"; do /usr/bin/python3 -c "import $module" 2> /dev/null || echo "python3-$module"; done
}

# Sets `as_root` to what must stand before apt-get; fails when packages cannot be installed from here.
may_install() {
   command -v apt-get > /dev/null || return 1
   as_root=()
   [[ $(id -u) == 0 ]] && return 0
   as_root=(sudo)
   command -v sudo > /dev/null && sudo -n true 2> /dev/null
}

# Prints what to install beside the given packages to get less: matplotlib's fonttools wants SciPy, which brings 300 MB of
# headers, or the small munkres, and apt-get takes the first where none of them is named.
lighter() {
   [[ " $* " != *" python3-matplotlib "* ]] || ! apt-cache show python3-munkres &> /dev/null || echo python3-munkres
}

# Makes sure that everything is there that is needed to build and to run the given Python modules.
# usage: prepare "package ..." "module ..." ["package that is good to have ..."]
prepare() {
   local packages=($1) modules=($2) extra=(${3-}) need=() python_need=()
   local imports all
   imports=$(IFS=,; echo "${modules[*]}")
   mkdir -p "$build_root"
   mapfile -t need < <(missing "${packages[@]}")
   find_python "$imports" || mapfile -t python_need < <(missing_modules "${modules[@]}")
   [[ ${#need[@]} == 0 && ${#python_need[@]} == 0 ]] && return 0

   if may_install; then
      all=("${need[@]}" "${python_need[@]}")
      say "installing ${all[*]}"
      if {
         "${as_root[@]}" apt-get update -qq &&
            "${as_root[@]}" env LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
               "${all[@]}" $(missing "${extra[@]}") $(lighter "${all[@]}")
      } 2>&1 | tee "$build_root/apt.log" | show_progress installing; then
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

# Seconds in words.
duration() {
   local seconds=$1
   if ((seconds < 90)); then echo "$seconds s"; else echo "$(((seconds + 30) / 60)) min"; fi
}

# Reads what Ninja, ctest or apt-get prints and says on standard error how far it is and about how long it still takes: in one line that is
# written over on a terminal, else in a line every 15 seconds.
# usage: ... | show_progress WHAT
show_progress() {
   local what=$1 line done=0 all=0 built=0 first=-1 last=$SECONDS units left words
   while IFS= read -r line; do
      if [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ ([A-Za-z]+) ]]; then
         done=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
         # Half of the steps scan sources for modules, in no time, and come first.
         units=$(((all + 1) / 2))
         [[ ${BASH_REMATCH[3]} != Building ]] || built=$((built + 1))
      elif [[ $line =~ ^\ *([0-9]+)/([0-9]+)\ Test\ +# ]]; then
         done=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]} units=$all built=$done
      elif [[ $line =~ ^([0-9]+)\ upgraded,\ ([0-9]+)\ newly ]]; then
         # Every package is fetched, unpacked and set up.
         all=$((3 * (BASH_REMATCH[1] + BASH_REMATCH[2]))) units=$all done=0 built=0 first=-1
      elif [[ $all != 0 && $line =~ ^(Get:|Unpacking\ |Setting\ up\ ) ]]; then
         done=$((done + 1)) built=$((built + 1))
      else
         continue
      fi
      ((first >= 0 || built == 0)) || first=$SECONDS
      left=
      ((built < 5 || built > units)) || left=", about $(duration $(((SECONDS - first) * (units - built) / built))) left"
      words="$me: $what [$done/$all]$left"
      if [[ -t 2 ]]; then
         printf '\r%s\e[K' "$words" >&2
      elif ((SECONDS - last >= 15)); then
         last=$SECONDS
         echo "$words" >&2
      fi
   done
   [[ ! -t 2 || $all == 0 ]] || printf '\r\e[K' >&2
}

# Is a build newer than all that it is made of, and made in the same way?
# usage: up_to_date FOLDER WORDS SOURCE ...
up_to_date() {
   local folder=$1 words=$2
   shift 2
   [[ -x $folder/unilat && -f $folder/.built && $(< "$folder/.built") == "$words" ]] || return 1
   [[ -z $(find "$@" -newer "$folder/.built" ! -name '*.pyc' ! -name __pycache__ -print -quit) ]]
}

# Configures and builds $build_root/NAME with a preset, where a source is newer; says how far it is, and else is silent when all is well.
# usage: build NAME preset [cmake option ...]
build() {
   local folder=$build_root/$1 preset=$2 log=$build_root/$1.log
   shift 2
   local words="$root $preset $python $*"
   local sources=("$root/CMakeLists.txt" "$root/.cmake" "$root/src" "$root/input/templates")
   [[ $* == *BUILD_TESTING=OFF* ]] || sources+=("$root/tests")
   ! up_to_date "$folder" "$words" "${sources[@]}" || return 0
   # A repository that was copied or moved together with its builds starts afresh.
   if [[ -f $folder/CMakeCache.txt ]] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$folder/CMakeCache.txt"; then
      rm -rf "$folder"
   fi
   mkdir -p "$folder"
   [[ -x $folder/unilat ]] || say "building in $folder, once: about two minutes of processor time"
   rm -f "$folder/.built"
   echo "$words" > "$folder/.building"  # what is changed from here on is newer
   if ! { cmake -C "$root/.cmake/$preset.cmake" -S "$root" -B "$folder" -DUNILAT_PYTHON="$python" "$@" &&
      cmake --build "$folder" --parallel "$((cores + 1))"; } 2>&1 | tee "$log" | show_progress building; then
      grep -vE '^\[[0-9]+/[0-9]+\] (Building|Generating|Linking)|^-- ' "$log" | tail -n 60 >&2
      die "the build failed (all its messages are in $log)"
   fi
   mv "$folder/.building" "$folder/.built"
}

# LAPACK and BLAS as Netlib has them (Debian: liblapack3, libblas3), to be loaded before those the program was linked with; nothing where they are not installed.
reference_libraries() {
   local file found=()
   for file in lapack/liblapack.so.3 blas/libblas.so.3; do
      compgen -G "/usr/lib/*/$file" > /dev/null || return 0
      found+=("$(compgen -G "/usr/lib/*/$file" | head -n 1)")
   done
   echo "${found[*]}"
}

# Completion of unilat, unilat-plot and unilat-sweep for bash.

_unilat_files() { # ending
   compopt -o filenames 2> /dev/null
   COMPREPLY+=($(compgen -f -X "!*.$1" -- "$word") $(compgen -d -- "$word"))
}

# Options that a command's help names.
_unilat_options() { COMPREPLY+=($(compgen -W "$("$@" --help 2> /dev/null | grep -oE -- '--[a-z][a-z-]*' | sort -u)" -- "$word")); }

_unilat() {
   local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} deck
   COMPREPLY=()
   case $before in
      --cards)
         # One word each, so that blanks need no quotes.
         COMPREPLY=($(compgen -W "$("${COMP_WORDS[0]}" --cards 2> /dev/null | sed -nE 's/^### `\*([A-Z ]+)`$/\1/p' | tr -d ' ')" -- "${word^^}"))
         return ;;
      -o | --restart) _unilat_files h5; return ;;
      --max-seconds | --from) return ;;
      --set)
         # The names on the *PARAMETER cards of the decks that are on the line.
         compopt -o nospace 2> /dev/null
         for deck in "${COMP_WORDS[@]}"; do
            [[ -f $deck ]] || continue
            COMPREPLY+=($(compgen -W "$(sed -nE 's/^[ \t]*([A-Za-z_][A-Za-z0-9_]*)[ \t]*=.*/\1=/p' "$deck")" -- "$word"))
         done
         return ;;
   esac
   if [[ $word == -* ]]; then
      _unilat_options "${COMP_WORDS[0]}"
      COMPREPLY+=($(compgen -W "-o" -- "$word"))
   elif [[ $before == init ]]; then
      COMPREPLY+=($(compgen -W "beam column liner pipe ring" -- "$word"))
   else
      _unilat_files inp
      ((COMP_CWORD > 1)) || [[ -z $word || init != "$word"* ]] || COMPREPLY+=(init)
   fi
}

_unilat_plot() {
   local word=${COMP_WORDS[COMP_CWORD]}
   COMPREPLY=()
   if ((COMP_CWORD == 1)); then
      COMPREPLY=($(compgen -W "model path shape contact reaction forces modes curve animate csv vtk html" -- "$word"))
   elif [[ $word == -* ]]; then
      _unilat_options "${COMP_WORDS[0]}" "${COMP_WORDS[1]}"
   elif [[ ${COMP_WORDS[1]} == model ]]; then
      _unilat_files inp
   else
      _unilat_files h5
   fi
}

_unilat_sweep() {
   local word=${COMP_WORDS[COMP_CWORD]}
   COMPREPLY=()
   if ((COMP_CWORD == 1)); then
      COMPREPLY=($(compgen -W "plan run status gather draw" -- "$word"))
   elif [[ $word == -* ]]; then
      _unilat_options "${COMP_WORDS[0]}"
   else
      _unilat_files toml
   fi
}

complete -F _unilat unilat
complete -F _unilat_plot unilat-plot
complete -F _unilat_sweep unilat-sweep

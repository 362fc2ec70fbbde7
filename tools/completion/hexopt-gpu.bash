# bash completion for hexopt-gpu: subcommands and options are read from the command's own --help.
_hexopt_gpu() {
  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]}
  local program=${COMP_WORDS[0]} words
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="--help --version $("$program" --help 2>/dev/null | sed -n '/^Subcommands:/,$ s/^  \([a-z][a-z-]*\) .*/\1/p')"
  elif [[ $word == -* ]]; then
    words=$("$program" "$command" --help 2>/dev/null | grep -oE '^  (-[a-z],)?--[a-z-]+' | grep -oE '\-\-[a-z-]+')
  elif [ "$command" = sample ] && [ "$COMP_CWORD" -eq 2 ]; then
    words=$("$program" sample --help 2>/dev/null | sed -n '/^Meshes (/,$ s/^  \([a-z][a-z0-9-]*\) .*/\1/p')
  else
    # Options that are one of a few words have them for a type: "  --method robust|thesis ".
    [[ $previous =~ ^--[a-z-]+$ ]] &&
      words=$("$program" "$command" --help 2>/dev/null | sed -nE "s/^  $previous ([a-z0-9]+(\\|[a-z0-9]+)+)( .*)?\$/\\1/p" | tr '|' ' ')
    [ "$previous" = --device ] && words="auto cpu vulkan"
    [ -n "$words" ] || { COMPREPLY=($(compgen -f -- "$word")); return; }
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}
complete -o filenames -F _hexopt_gpu hexopt-gpu

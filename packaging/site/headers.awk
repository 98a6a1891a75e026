# A header's // comments as doxygen takes them: the opening one is the file's, one behind a member belongs to it.
NR == 1 && /^\/\// { print "/// \\file" }
{
  if ($0 ~ /^ *\/\/([^\/]|$)/) sub(/\/\//, "///")
  else if (match($0, /[;,{] +\/\/ ?[^\/]/)) {
    head = substr($0, 1, RSTART); rest = substr($0, RSTART + 1); sub(/^ +\/\/ ?/, "", rest)
    $0 = head "  ///< " rest
  }
  print
}

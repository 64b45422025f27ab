#!/bin/sh
# Lets POV-Ray's `lathe` answer a suite of rays, for `photolathe grade`.
#   povray.sh SCENE.toml RAYS.csv THEIRS.csv [sturm]
# SCENE holds one surface of revolution. `sturm` is POV-Ray's slower, more careful root solver.
# POV-Ray computes in doubles; distances pass through text of 17 decimals.
set -eu
scene=$1 rays=$2 theirs=$3 sturm=${4:-}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PHOTOLATHE:-photolathe}" export "$scene" --to povray -o "$work" 2>/dev/null
{
  echo '#version 3.7; #declare Thing ='
  awk '/^lathe/ { found = 1 } found { print } found && /matrix/ { exit }' "$work/scene.pov"
  echo "  $sturm }"
  cat <<'SDL'
#fopen Rays "rays.txt" read
#fopen Answers "answers.txt" write
#while (defined(Rays))
  #read (Rays, OX, OY, OZ, DX, DY, DZ)
  #declare N = <0, 0, 0>;
  #declare P = trace(Thing, <OX, OY, OZ>, <DX, DY, DZ>, N);
  #if (vlength(N) = 0)
    #write (Answers, "0,\n")
  #else
    #write (Answers, concat("1,", str(vdot(P - <OX, OY, OZ>, <DX, DY, DZ>), 0, 17), "\n"))
  #end
#end
camera { location z }
SDL
} > "$work/ask.pov"
# Origins and unit directions; |d| is kept to turn distances into t.
awk -F, 'NR > 1 { s = $6*$6 + $7*$7 + $8*$8; l = sqrt(s); printf "%.17g\n", l > lengths
  printf "%s%s,%s,%s,%.17g,%.17g,%.17g", separator, $3, $4, $5, $6/l, $7/l, $8/l; separator = ",\n" }' lengths="$work/lengths.txt" \
  "$rays" > "$work/rays.txt"
(cd "$work" && povray +Iask.pov +W1 +H1 -F -D -GA >povray.log 2>&1) || { tail -5 "$work/povray.log" >&2; exit 2; }
{
  echo hit,t
  paste -d, "$work/answers.txt" "$work/lengths.txt" |
    awk -F, '$1 == 1 { printf "1,%.17g\n", $2 / $3; next } { print "0," }'
} > "$theirs"

# For doxygen, the formulas of doc/*.md: GitHub writes them $...$ and ```math, doxygen \f$...\f$ and \f[...\f].
/^```math$/,/^```$/{
s/^```math$/\\f[/
s/^```$/\\f]/
b
}
s/\$([^$]+)\$/\\f$\1\\f$/g

# What ctest did not run, one line each, with the reason:
#
#   awk -f tools/skipped.awk OUTPUT-LOG LastTest.log
#
#   test <tab> name <tab> reason         a whole test
#   case <tab> name: case <tab> reason   a case that a passing GoogleTest program skipped

FNR == NR {  # lines of progress: 2/3 Test #2: IoReal ....***Skipped   0.01 sec
    if (/ Test +#[0-9]+: .*\*\*\*Skipped/) {
        sub(/.* Test +#[0-9]+: /, "")
        sub(/ *\.*\*\*\*Skipped.*/, "")
        whole[$0] = 1
    }
    next
}

/^[0-9]+\/[0-9]+ Testing: / {
    sub(/^[0-9]+\/[0-9]+ Testing: /, "")
    test = $0
    reason = ""
    if (test in whole) order[++tests] = test
    next
}

/: Skipped$/ {  # GoogleTest: file:line: Skipped, and below it the reason
    getline reason
    if (!(test in why)) why[test] = reason
    next
}

/^skipped: / {
    if (!(test in why)) why[test] = substr($0, 10)
    next
}

/^\[  SKIPPED \] .* \([0-9]+ ms\)$/ && !(test in whole) {
    print "case\t" test ": " $4 "\t" reason
}

END {
    for (i = 1; i <= tests; ++i)
        print "test\t" order[i] "\t" why[order[i]]
}

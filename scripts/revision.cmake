# Writes the git revision of SOURCE into the C++ file TARGET, run at every build. A file that stays the same is not touched,
# so that nothing is compiled again. Outside of git the revision is empty.
find_program(GIT git)
set(revision "")
if(GIT AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --short=10 HEAD
    OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  execute_process(COMMAND ${GIT} -C ${SOURCE} --no-optional-locks diff-index --quiet HEAD --
    RESULT_VARIABLE modified OUTPUT_QUIET ERROR_QUIET)
  if(revision AND modified EQUAL 1)
    string(APPEND revision ", modified")
  endif()
endif()
set(text "extern const char *const squeal_revision;\nconst char *const squeal_revision = \"${revision}\";\n")
set(before "")
if(EXISTS ${TARGET})
  file(READ ${TARGET} before)
endif()
if(NOT before STREQUAL text)
  file(WRITE ${TARGET} "${text}")
endif()

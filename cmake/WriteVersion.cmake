# Writes OUT, a .cpp that knows VERSION and the commit of SOURCE; touches it only when that changes.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=10 --exclude=*
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT [[
#include "common/config/version.h"
std::string chase::config::Version() { return "@VERSION@ (commit @commit@)"; }
]])

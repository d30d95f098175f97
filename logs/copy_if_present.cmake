# Copies FROM to TO where FROM exists.
if(EXISTS ${FROM})
  configure_file(${FROM} ${TO} COPYONLY)
endif()

# Installs the package, builds the consumer against it and runs that.
# cmake -DSOURCE=repo -DBUILD=its build -P consumer.cmake
set(work ${BUILD}/test/package)
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "failed: ${ARGN}")
  endif()
endfunction()
file(REMOVE_RECURSE ${work})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix --component development)
run(${CMAKE_COMMAND} -S ${SOURCE}/test/package/consumer -B ${work}/build
  -DCMAKE_PREFIX_PATH=${work}/prefix "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}")
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/consumer ${SOURCE}/deploy/scenarios/scenes/predict_pillar.yaml
  ${SOURCE}/deploy/scenarios/scenes/pillars.yaml)

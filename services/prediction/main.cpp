#include "common/bus/run_service.h"
#include "services/prediction/prediction_node.h"

int main(int argc, char** argv) {
  return chase::bus::RunService<chase::prediction::PredictionNode,
                                chase::prediction::PredictionConfig>(
      "prediction", "Forecasts the target: target and obstacles in, prediction out.", argc, argv);
}

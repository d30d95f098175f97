#pragma once

#include "common/bus/log_reader.h"

namespace chase::logs {

using bus::Damage, bus::LogEvent, bus::LogOf, bus::LogReader, bus::Watch;

}  // namespace chase::logs

// Precompiled for all test programs, see splat_precompile in cmake/SplatTargets.cmake. Nothing includes this file.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

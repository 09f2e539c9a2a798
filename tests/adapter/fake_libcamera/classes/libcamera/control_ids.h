#pragma once

#include "fake.h"

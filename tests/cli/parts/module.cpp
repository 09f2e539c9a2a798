// A module of the command for tests, with a stamp of its own, another one, or none.
extern "C" {
int answer() { return 42; }
#if defined(LOWLUX_OTHER_STAMP)
extern const char lowlux_module_stamp[];
const char lowlux_module_stamp[] = LOWLUX_OTHER_STAMP;
#endif
}

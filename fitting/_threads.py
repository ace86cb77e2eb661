"""One thread a process, for several processes side by side. Imports nothing heavy."""

# Read when NumPy and JAX are imported, and when the first program is compiled (XLA: `NPROC`). With
# a thread for each processor, processes side by side wait for each other: eight diagnoses, two at a
# time on two processors, took 85 s, and with these 73, with the same answers to the last digit.
ONE_THREAD = dict.fromkeys(
    ("MKL_NUM_THREADS", "NPROC", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
)

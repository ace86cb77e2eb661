"""Files of other programs as named columns of numbers: text, MATLAB, NumPy, HDF5, TDMS."""

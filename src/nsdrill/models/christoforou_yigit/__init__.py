"""The axial, torsional and lateral oscillator of Christoforou and Yigit."""

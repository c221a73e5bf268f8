"""Precision agriculture (Bhoopathy et al.): a UAS finds a target, a UGV drives to it."""
